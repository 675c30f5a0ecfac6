#include "nozzle_place.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace unflex::verify {
namespace {

// The nozzle's place is searched up to this multiple of |p − r| around the reference.
constexpr double kSearch = 3.0;

// The place on a piece of the path that is nearest to a point.
struct Foot {
  double along_mm = 0.0;
  double distance2_mm2 = std::numeric_limits<double>::infinity();
};

Foot foot_on(const PathPiece& piece, double x_mm, double y_mm) {
  const double x = x_mm - piece.x_mm;
  const double y = y_mm - piece.y_mm;
  const double along =
      std::clamp(x * piece.direction_x + y * piece.direction_y, 0.0, piece.length_xy_mm);
  const double across_x = x - along * piece.direction_x;
  const double across_y = y - along * piece.direction_y;
  return {along, across_x * across_x + across_y * across_y};
}

}  // namespace

PathPlace nearest_place(const ReferencePath& path, std::size_t current, double r_x_mm,
                        double r_y_mm, double p_x_mm, double p_y_mm) {
  const double off_x_mm = p_x_mm - r_x_mm;
  const double off_y_mm = p_y_mm - r_y_mm;
  const double reach_mm = kSearch * std::sqrt(off_x_mm * off_x_mm + off_y_mm * off_y_mm);
  const double reference_mm = foot_on(path[current], r_x_mm, r_y_mm).along_mm;
  Foot best;
  std::size_t nearest = current;
  const auto look_at = [&](std::size_t number) {
    const Foot foot = foot_on(path[number], p_x_mm, p_y_mm);
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
