#include "ahead_check.hpp"

#include <fmt/core.h>

#include <cmath>

#include "line_check.hpp"

namespace unflex::verify {

// The command that the line gives to the hotend in use.
std::optional<gcode::HotendCommand> AheadCheck::command(const gcode::Line& line) const {
  const auto command = gcode::hotend_command(gcode::parse(line.content()), firmware_);
  return command && command->tool.value_or(tool_) == tool_ ? command : std::nullopt;
}

bool AheadCheck::takes(const gcode::Line& output) {
  if (!allowed_ || awaited_) {
    return false;
  }
  const auto asked = command(output);
  if (!asked || asked->waits || asked->target_c.value_or(0.0) <= 0.0) {
    return false;
  }
  awaited_ = output;
  target_c_ = *asked->target_c;
  return true;
}

bool AheadCheck::is_awaited(const gcode::Line& input) const {
  return awaited_ && same_line(input, *awaited_);
}

std::optional<std::string> AheadCheck::pass(const gcode::Line& line, bool loses_place) {
  if (!allowed_) {
    return std::nullopt;
  }
  const gcode::Command parsed = gcode::parse(line.content());
  const auto tool = gcode::selected_tool(parsed, firmware_);
  const auto asked = command(line);
  tool_ = tool.value_or(tool_);
  if (!awaited_) {
    return std::nullopt;
  }
  if (asked && asked->waits && is_target(asked->target_c)) {
    arrive();  // it was added, so that this one waits less
    return std::nullopt;
  }
  return asked || tool || loses_place || gcode::pauses_print(parsed) ? never_asked() : std::nullopt;
}

// The temperature of a line that was added is rounded.
bool AheadCheck::is_target(std::optional<double> asked_c) const {
  constexpr double kRounding_c = 0.005 + 1e-9;
  return asked_c && std::abs(*asked_c - target_c_) <= kRounding_c;
}

std::optional<std::string> AheadCheck::end() { return awaited_ ? never_asked() : std::nullopt; }

std::optional<std::string> AheadCheck::never_asked() {
  std::string message =
      fmt::format("'{}' asks for a temperature that is not the next one the sliced file asks for",
                  awaited_->content());
  awaited_.reset();
  return message;
}

}  // namespace unflex::verify
