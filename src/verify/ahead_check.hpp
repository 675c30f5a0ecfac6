// Checks lines that ask for a temperature ahead of their place in the sliced file. All other lines
// must keep their place. Lines may be added only in the forms that unflex adds. A line that asks
// ahead must not wait. It must pass no other command to the hotend, no change of the tool, no
// pause, and no line that may be any of these. The next temperature that the sliced file asks for
// must be its own.
#pragma once

#include <optional>
#include <string>

#include "unflex/core/firmware.hpp"
#include "unflex/gcode/hotend_command.hpp"
#include "unflex/gcode/line.hpp"

namespace unflex::verify {

class AheadCheck {
 public:
  // allowed: whether any line may be ahead.
  AheadCheck(Firmware firmware, bool allowed) : firmware_(firmware), allowed_(allowed) {}

  // Whether a line of the output that the sliced file does not have here asks ahead. If so, the
  // sliced file's own line is awaited from now on.
  [[nodiscard]] bool takes(const gcode::Line& output);
  // Whether a line of the sliced file that the output does not have here is the awaited one.
  [[nodiscard]] bool is_awaited(const gcode::Line& input) const;
  // The awaited line has come.
  void arrive() { awaited_.reset(); }
  // Passes a line that both files have here. loses_place: the line may move the machine or do
  // anything. Returns an error text if the awaited line should have come before this line.
  [[nodiscard]] std::optional<std::string> pass(const gcode::Line& line, bool loses_place);
  // Both files have ended. Returns an error text if a line is still awaited.
  [[nodiscard]] std::optional<std::string> end();

 private:
  [[nodiscard]] std::optional<gcode::HotendCommand> command(const gcode::Line& line) const;
  [[nodiscard]] bool is_target(std::optional<double> asked_c) const;
  [[nodiscard]] std::optional<std::string> never_asked();

  Firmware firmware_;
  bool allowed_;
  int tool_ = 0;
  std::optional<gcode::Line> awaited_;
  double target_c_ = 0.0;
};

}  // namespace unflex::verify
