// What a slicer wrote into a print about the printer it was sliced for.
#pragma once

#include "assign.hpp"
#include "unflex/machine/print_text.hpp"

namespace unflex::machine {

// Reads the settings that PrusaSlicer, SuperSlicer, Slic3r, OrcaSlicer and Bambu Studio write as
// comments at the head or the tail, and the flavor Cura names at the head. Taken are the firmware,
// the machine limits (unless the slicer was told to ignore them) and the diameters of nozzle and
// filament. The bed's shape is not: motors reach beyond it.
[[nodiscard]] Reading read_slicer(const PrintText& print);

// A slicer that writes its settings at the end, where a stream's come too late; else "".
[[nodiscard]] std::string_view slicer_with_late_settings(const PrintText& print);

}  // namespace unflex::machine
