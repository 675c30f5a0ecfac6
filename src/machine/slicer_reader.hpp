// What a slicer wrote into a print about the printer it was sliced for.
#pragma once

#include <optional>

#include "assign.hpp"
#include "unflex/core/firmware.hpp"
#include "unflex/machine/print_text.hpp"

namespace unflex::machine {

// Reads the settings that PrusaSlicer, SuperSlicer, Slic3r, OrcaSlicer and Bambu Studio write as
// comments at the head or the tail, and the flavor Cura names at the head. Taken are the diameters
// of nozzle and filament, and, unless the slicer was told to ignore them, the machine limits, if
// they are for the firmware that is to run the output: many who have a Klipper slice for "marlin".
// The bed's shape is not taken: motors reach beyond it.
//
// runs: that firmware; unset: the one the slicer names, which is then taken as well. by_default:
// nobody has named it.
[[nodiscard]] Reading read_slicer(const PrintText& print, std::optional<Firmware> runs,
                                  bool by_default);

// A slicer that writes its settings at the end, where a stream's come too late; else "".
[[nodiscard]] std::string_view slicer_with_late_settings(const PrintText& print);

}  // namespace unflex::machine
