// What each firmware does with lines, as a table of functions. The tables are in src/firmware.
#pragma once

#include <cstddef>
#include <optional>
#include <string_view>

#include "arc.hpp"
#include "firmware_commands.hpp"
#include "unflex/core/firmware.hpp"
#include "unflex/gcode/hotend_command.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {

struct FirmwareReader {
  // Fills the event of the line, which has been parsed.
  void (Interpreter::*read)(Event& event, std::string_view content);
  // What an M-code without a handler of its own does.
  Effect (*m_code_effect)(int number);
  // The pieces that an arc becomes. The options tell how fine they are.
  ArcPieces (*plan_arc)(const Arc& arc, double feed_mm_s, const Command& command,
                        const InterpreterOptions& options);
  std::optional<HotendCommand> (*hotend_command)(const Command& command);
  // The tool that a command selects which is no T.
  std::optional<int> (*selected_tool)(const Command& command);
  // Whether the line is none that a printer carries out, but steers which ones are.
  bool (*is_meta_command)(std::string_view content);
};

}  // namespace unflex::gcode

namespace unflex::firmware {

#define UNFLEX_FIRMWARE(name)                 \
  namespace name {                            \
  extern const gcode::FirmwareReader kReader; \
  }
UNFLEX_FIRMWARES(UNFLEX_FIRMWARE)
#undef UNFLEX_FIRMWARE

}  // namespace unflex::firmware

namespace unflex::gcode {

[[nodiscard]] inline const FirmwareReader& reader_of(Firmware firmware) {
#define UNFLEX_FIRMWARE(name) &firmware::name::kReader,
  static constexpr const FirmwareReader* kReaders[] = {UNFLEX_FIRMWARES(UNFLEX_FIRMWARE)};
#undef UNFLEX_FIRMWARE
  return *kReaders[static_cast<std::size_t>(firmware)];
}

}  // namespace unflex::gcode
