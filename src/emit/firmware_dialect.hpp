// Limits and filters in a firmware's own commands, as a table of functions. The tables are in
// src/firmware.
#pragma once

#include <string>
#include <vector>

#include "dialect.hpp"
#include "unflex/core/firmware_tables.hpp"
#include "unflex/emit/run_limits.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::emit {

// The axes whose shapers are to be written.
using ShaperAxes = Axes<bool>;

struct FirmwareDialect {
  // Appends the lines that put `wanted` in force in the place of `current`.
  void (*limit_lines)(const planner::FirmwareConfig& config, const planner::Limits& wanted,
                      const planner::Limits& current, std::vector<std::string>& lines);
  // Sets the limits of a run. What is not set stays as the file has it.
  void (*set_run_limits)(const planner::FirmwareConfig& config, const RunLimits& run,
                         planner::Limits& limits);
  void (*shaper_lines)(const gcode::Shaper& wanted, const gcode::Shaper& current, ShaperAxes axes,
                       std::vector<std::string>& lines);
  // The line that sets pressure advance; null: the command of the spec with the advance behind it.
  std::string (*advance_line)(const gcode::PressureAdvance& wanted) = nullptr;
  // The command to type to switch the shapers of these axes on again.
  std::string (*unknown_shaper_lines)(ShaperAxes axes);
};

}  // namespace unflex::emit

namespace unflex {
UNFLEX_FIRMWARE_TABLES(emit::FirmwareDialect, kDialect)
}

namespace unflex::emit {

[[nodiscard]] inline const FirmwareDialect& dialect_of(Firmware firmware) {
  return UNFLEX_TABLE_OF(firmware, kDialect);
}

}  // namespace unflex::emit
