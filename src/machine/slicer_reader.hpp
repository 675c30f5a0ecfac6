// The settings of the printer that a slicer wrote into a print.
#pragma once

#include <optional>

#include "assign.hpp"
#include "unflex/core/firmware.hpp"
#include "unflex/machine/print_text.hpp"

namespace unflex::machine {

// Reads the settings that PrusaSlicer, SuperSlicer, Slic3r, OrcaSlicer and Bambu Studio write as
// comments at the head or the tail, and the flavor Cura names at the head. It takes the diameters
// of nozzle and filament. It also takes the machine limits, unless the slicer was told to ignore
// them or they are for another firmware than the one that is to run the output: many who have a
// Klipper slice for "marlin". The bed's shape is not taken: motors reach beyond it.
//
// runs: the firmware that is to run the output; unset: the one that the slicer names, which is then
// taken as a setting too. by_default: `runs` is only the default, no source has named it.
[[nodiscard]] Reading read_slicer(const PrintText& print, std::optional<Firmware> runs,
                                  bool by_default);

// The name of the slicer, if the print is a stream and its settings come at the end, too late; else
// "".
[[nodiscard]] std::string_view slicer_with_late_settings(const PrintText& print);

}  // namespace unflex::machine
