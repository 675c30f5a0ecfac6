#include "source_kind.hpp"

#include <algorithm>
#include <array>

#include "key_table.hpp"
#include "text_lines.hpp"
#include "unflex/gcode/command.hpp"

namespace unflex::machine {
namespace {

// Commands with which RepRapFirmware describes a machine, and which no print and no dump of
// Marlin's has: drives, axes, end stops, heaters, kinematics, board's name, jerk, other files.
constexpr std::array kRrfCodes = {98, 550, 558, 563, 566, 574, 584, 667, 669, 950};
// Commands that Marlin's M503 lists and RepRapFirmware does not know: temperatures' presets and
// units, automatic retraction, bed levelling, the probe's offset, linear advance, filament change.
constexpr std::array kMarlinCodes = {145, 149, 209, 420, 603, 851, 900};

struct Traces {
  int echoes = 0;
  int rrf_settings = 0;
  int marlin_settings = 0;
  int settings = 0;  // M92, M201 and the like
  int moves = 0;
  int klipper = 0;  // sections and options no TOML of ours has
  int headers = 0;
  int firmware_names = 0;  // as M115 tells them
};

bool is_one_of(int number, const auto& codes) {
  return std::ranges::find(codes, number) != codes.end();
}

// Commands that both firmwares know are told apart by their words. M203 is in mm/min, but in Marlin
// in mm/s.
bool is_rrf_setting(const gcode::Command& command) {
  constexpr double kFasterThanAnyMarlin = 1500.0;
  switch (command.number) {
    case 203:
      return std::max(command.value('X').value_or(0.0), command.value('Y').value_or(0.0)) >
             kFasterThanAnyMarlin;
    case 208:
      return command.has_any("XYZ");
    case 350:
      return command.has('I');
    case 569:
    case 593:
      return command.has('P');
    default:
      return is_one_of(command.number, kRrfCodes);
  }
}

bool is_marlin_setting(const gcode::Command& command) {
  switch (command.number) {
    case 205:
      return command.has_any("BSTJ");
    case 569:
      return command.has('S') && !command.has('P');
    case 593:
      return command.has_any("XYD");
    default:
      return is_one_of(command.number, kMarlinCodes);
  }
}

void look_at_command(std::string_view line, Traces& traces) {
  const gcode::Command command = gcode::parse(line);
  if (command.kind != gcode::CommandKind::traditional) {
    return;
  }
  traces.moves += command.letter == 'G' && command.number >= 0 && command.number <= 3 ? 1 : 0;
  if (command.letter == 'M') {
    constexpr std::array kOfBoth = {92, 201, 203, 204, 205, 207, 208, 566, 593};
    traces.settings += is_one_of(command.number, kOfBoth) ? 1 : 0;
    traces.rrf_settings += is_rrf_setting(command) ? 1 : 0;
    traces.marlin_settings += is_marlin_setting(command) ? 1 : 0;
  }
}

void look_at(std::string_view line, Traces& traces) {
  const std::string_view content = trimmed(line);
  traces.firmware_names += content.find("FIRMWARE_NAME:") != std::string_view::npos ? 1 : 0;
  const std::size_t echo = content.find("echo:");
  if (echo != std::string_view::npos) {
    ++traces.echoes;
    return look_at_command(content.substr(echo + 5), traces);
  }
  if (content.starts_with('[') && content.find(']') != std::string_view::npos) {
    const std::string_view name = content.substr(1, content.find(']') - 1);
    ++traces.headers;
    const bool is_klippers = name.starts_with("stepper_") || name.starts_with("include ") ||
                             name.starts_with("mcu") || name == "input_shaper";
    traces.klipper += is_klippers ? 2 : 0;
    return;
  }
  const std::size_t delimiter = content.find_first_of(":=");
  if (delimiter != std::string_view::npos && delimiter > 0 && content.front() != '#' &&
      content.front() != ';') {
    const std::string_view name = trimmed(content.substr(0, delimiter));
    // No key of our TOML is called "kinematics", and TOML has no colons there.
    traces.klipper += name == "kinematics" ? 2 : 0;
    traces.klipper += traces.headers > 0 && content[delimiter] == ':' && content.front() != '"';
  }
  look_at_command(content, traces);
}

// A table of an accelerometer, as Klipper, its tools and RepRapFirmware write it: a head of
// columns, numbers with commas below it.
bool is_record(std::string_view text) {
  const std::string head = lower(text.substr(0, text.find('\n')));
  const auto has = [&](std::string_view word) { return head.find(word) != std::string::npos; };
  return head.find(',') != std::string::npos &&
         ((has("freq") && has("psd")) || has("accel_x") || (has("sample") && has("x")));
}

}  // namespace

SourceKind source_kind(std::string_view text) {
  if (is_record(text)) {
    return SourceKind::record;
  }
  Traces traces;
  for_each_line(text, 1, [&](std::string_view line, std::size_t) { look_at(line, traces); });
  if (traces.headers > 0 && traces.klipper > 1) {
    return SourceKind::klipper;
  }
  if (traces.moves > 10 || (traces.moves > 0 && traces.rrf_settings < 2 && traces.echoes == 0)) {
    return SourceKind::print;
  }
  if (traces.echoes > 1 && traces.settings > 0) {
    return SourceKind::marlin_dump;
  }
  if (traces.rrf_settings > traces.marlin_settings) {
    return SourceKind::rrf_config;
  }
  if (traces.settings > 1 && traces.headers == 0) {
    return SourceKind::marlin_dump;
  }
  const bool is_answer = traces.firmware_names > 0 && traces.settings == 0 && traces.headers == 0;
  return is_answer ? SourceKind::m115_answer : SourceKind::toml;
}

}  // namespace unflex::machine
