// What a run may do where its timing is free.
#pragma once

#include <optional>
#include <vector>

#include "unflex/emit/emit_options.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/run/piece_reader.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::run {

// What each move of the run may do.
[[nodiscard]] std::vector<timing::MoveBounds> move_bounds(const Piece& run,
                                                          const machine::Settings& settings);
// What lays the run, and how evenly it is to lay; nullopt: its width does not count.
[[nodiscard]] std::optional<timing::Extruder> extruder_of(const Piece& run,
                                                          const emit::EmitOptions& options,
                                                          const machine::TimingSettings& timing);

}  // namespace unflex::run
