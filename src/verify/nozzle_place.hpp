// Where along the sliced path the nozzle is.
#pragma once

#include <cstddef>

#include "unflex/core/xy.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

struct PathPlace {
  std::size_t piece = 0;  // number of the piece
  double along_mm = 0.0;  // since the piece began, in X and Y
};

// The place that is nearest to the nozzle p. The path may come close to itself, so it is searched
// only around the reference r, which is on the piece `current`, and no further than a few times
// |p − r|.
[[nodiscard]] PathPlace nearest_place(const ReferencePath& path, std::size_t current,
                                      const XY& r_mm, const XY& p_mm);

}  // namespace unflex::verify
