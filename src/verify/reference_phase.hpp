// How the reference moves for a while.
#pragma once

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

// The reference during one phase of one of its moves.
struct ReferencePhase {
  dynamics::BaseXY xy;
  bool extruding = false;
};

// The reference's motion on a piece of its path, for duration_s from time_s on. Meanwhile it must
// change neither its acceleration nor its move.
[[nodiscard]] ReferencePhase reference_phase(const PathPiece& piece, double time_s,
                                             double duration_s);

}  // namespace unflex::verify
