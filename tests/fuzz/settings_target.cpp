// Descriptions of a printer in all forms.
#include <string>
#include <vector>

#include "bytes.hpp"
#include "text_checks.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/machine/recommend.hpp"
#include "unflex/run/emit_options.hpp"
#include "unflex/run/setup.hpp"
#include "unflex/run/verify_rules.hpp"

namespace unflex::fuzz {
namespace {

enum class As { file, head, stream, overrides };

std::vector<std::string> lines_of(Bytes source) {
  constexpr std::size_t kMost = 32;
  std::vector<std::string> lines;
  while (!source.empty() && lines.size() < kMost) {
    lines.emplace_back(source.line());
  }
  return lines;
}

Result<machine::Settings> read(Bytes source, As as) {
  if (as == As::file) {
    return machine::parse(source.rest(), "nowhere/printer", {});
  }
  if (as == As::overrides) {
    return machine::load(std::nullopt, lines_of(source));
  }
  const std::string text(source.rest());
  const machine::PrintText print{.name = "print.gcode",
                                 .head = text.substr(0, machine::head_end(text)),
                                 .tail = as == As::stream ? "" : text,
                                 .tail_line = as == As::stream ? 0U : 1U,
                                 .is_stream = as == As::stream};
  static_cast<void>(machine::describes_printer(print));
  return machine::load(machine::Sources{
      .print = &print, .printer_file = {}, .overrides = {}, .firmware_as_sliced = true});
}

// Each stage must accept its part of the settings without a number that its types cannot hold.
void turn_into_options(const machine::Settings& settings) {
  static_cast<void>(run::compensate_setup(settings));
  static_cast<void>(run::emit_options(settings, "fuzz"));
  static_cast<void>(run::verify_rules(settings));
}

}  // namespace

void settings(std::string_view bytes) {
  Bytes source(bytes);
  const As as = static_cast<As>(source.variant(4));
  const Result<machine::Settings> settings = read(source, as);
  if (!settings) {
    return require_fault_of_input(settings.error());
  }
  for (const Diagnostic& note : settings->notes) {
    require_one_line(to_string(note));
  }
  for (const std::string& recommendation : machine::recommendations(*settings)) {
    require_one_line(recommendation);
  }
  turn_into_options(*settings);
  const std::string toml = machine::to_toml(*settings);
  const Result<machine::Settings> again = machine::parse(toml, "again.toml", {});
  require(again.has_value(),
          again ? "" : "what was read is refused when it is written: " + to_string(again.error()));
  const std::vector<machine::SettingRow> before = machine::rows(*settings);
  const std::vector<machine::SettingRow> after = machine::rows(*again);
  for (std::size_t i = 0; i < before.size(); ++i) {
    require(before[i].value == after[i].value,
            before[i].key + " was " + before[i].value + " and is read again as " + after[i].value);
  }
}

}  // namespace unflex::fuzz
