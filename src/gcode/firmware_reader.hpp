// A table of functions for each firmware, which read its lines. The tables are in src/firmware.
#pragma once

#include <optional>
#include <string_view>

#include "arc.hpp"
#include "firmware_commands.hpp"
#include "unflex/core/firmware_tables.hpp"
#include "unflex/gcode/hotend_command.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {

struct FirmwareReader {
  // Fills the event of the line, which has been parsed.
  void (Interpreter::*read)(Event& event, std::string_view content);
  // The effect of an M-code without a handler of its own.
  Effect (*m_code_effect)(int number);
  // The pieces that an arc becomes. The options tell how fine they are.
  ArcPieces (*plan_arc)(const Arc& arc, double feed_mm_s, const Command& command,
                        const InterpreterOptions& options);
  std::optional<HotendCommand> (*hotend_command)(const Command& command);
  // The tool that a command other than T selects.
  std::optional<int> (*selected_tool)(const Command& command);
  // Whether the line is no command but decides which lines are carried out.
  bool (*is_meta_command)(std::string_view content);
};

}  // namespace unflex::gcode

namespace unflex {
UNFLEX_FIRMWARE_TABLES(gcode::FirmwareReader, kReader)
}

namespace unflex::gcode {

[[nodiscard]] inline const FirmwareReader& reader_of(Firmware firmware) {
  return UNFLEX_TABLE_OF(firmware, kReader);
}

}  // namespace unflex::gcode
