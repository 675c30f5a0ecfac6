#include "nozzle_place.hpp"

#include <cmath>
#include <limits>

#include "unflex/verify/nearest_along.hpp"

namespace unflex::verify {
namespace {

// The nozzle's place is searched up to this multiple of |p − r| around the reference.
constexpr double kSearch = 3.0;

// The place on a piece of the path that is nearest to a point.
struct Foot {
  double along_mm = 0.0;
  double distance2_mm2 = std::numeric_limits<double>::infinity();
};

Foot foot_on(const PathPiece& piece, const XY& place_mm) {
  const XY off_mm = place_mm - piece.start_mm;
  const double along_mm = nearest_along_mm(off_mm, piece.direction, piece.length_xy_mm);
  return {along_mm, distance2_mm2(off_mm, piece.direction, along_mm)};
}

}  // namespace

PathPlace nearest_place(const ReferencePath& path, std::size_t current, const XY& r_mm,
                        const XY& p_mm) {
  const double reach_mm = kSearch * std::sqrt(squared(p_mm - r_mm));
  const double reference_mm = foot_on(path[current], r_mm).along_mm;
  Foot best;
  std::size_t nearest = current;
  const auto look_at = [&](std::size_t number) {
    const Foot foot = foot_on(path[number], p_mm);
    if (foot.distance2_mm2 < best.distance2_mm2) {
      best = foot;
      nearest = number;
    }
  };
  look_at(current);
  double back_mm = reference_mm;
  for (std::size_t number = current; number > path.first() && back_mm <= reach_mm;) {
    look_at(--number);
    back_mm += path[number].length_xy_mm;
  }
  double ahead_mm = path[current].length_xy_mm - reference_mm;
  for (std::size_t number = current + 1; number < path.end() && ahead_mm <= reach_mm; ++number) {
    look_at(number);
    ahead_mm += path[number].length_xy_mm;
  }
  return {nearest, best.along_mm};
}

}  // namespace unflex::verify
