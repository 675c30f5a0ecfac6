// How far the filament that is laid lags behind the nozzle.
//
// Notation:
//   F      filament that has been laid, mm     s_p    where along the sliced path the nozzle is
//   Q(s)   filament that the sliced file lays up to there
//   s_F    the place whose filament comes out now: Q(s_F) = F
//   lag    s_p − s_F, mm of path. Between places of two lines the travel is left out. If the nozzle
//          travels already, or still, while filament comes out, that way counts.
//
// The path may come close to itself. So it is searched only around r, no further than a few times
// |p − r|.
#pragma once

#include <cstddef>

#include "nozzle_place.hpp"
#include "unflex/verify/reference_path.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::verify {

class FilamentLag {
 public:
  // Adds a step of h seconds, with the nozzle at this place of the path. flows: filament comes out
  // now. At least one must hold: filament comes out, or the reference lays filament.
  void add(const ReferencePath& path, const PathPlace& nozzle, double laid_mm, bool flows,
           double h);
  [[nodiscard]] LagStats stats() const;

 private:
  double sum_lag2_ = 0.0;
  double weight_s_ = 0.0;
  double largest_mm_ = 0.0;
  std::size_t line_ = 0;
};

}  // namespace unflex::verify
