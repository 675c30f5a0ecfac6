// Bounds for a run whose timing is free.
#pragma once

#include <optional>
#include <vector>

#include "unflex/emit/emit_options.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/run/piece_reader.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::run {

// The bounds of each move of the run.
[[nodiscard]] std::vector<timing::MoveBounds> move_bounds(const Piece& run,
                                                          const machine::Settings& settings);
// The extruder that lays the run, and how evenly it shall lay. nullopt: the run's width does not
// count.
[[nodiscard]] std::optional<timing::Extruder> extruder_of(const Piece& run,
                                                          const emit::EmitOptions& options,
                                                          const machine::TimingSettings& timing);

}  // namespace unflex::run
