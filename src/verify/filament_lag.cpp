#include "filament_lag.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "rounding.hpp"

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

double filament_per_mm(const PathPiece& piece) {
  return piece.extruding ? piece.move.segment.delta(gcode::E) / piece.length_xy_mm : 0.0;
}

// The lag s_p − s_F, with Q(s_F) = laid_mm. It is below 0 if s_F is ahead. s_p is given by the
// piece's number and along_mm.
double laid_lag_mm(const ReferencePath& path, std::size_t number, double along_mm, double laid_mm) {
  const bool travels = !path[number].extruding;
  if (travels && std::abs(laid_mm - path[number].filament_mm) < kRounding_mm) {
    return 0.0;  // what is laid before the travel is complete
  }
  const auto counts = [&] { return travels || path[number].extruding; };
  double lag_mm = 0.0;
  while (laid_mm < path[number].filament_mm && number > path.first()) {
    lag_mm += counts() ? along_mm : 0.0;
    along_mm = path[--number].length_xy_mm;
  }
  const auto lays_mm = [&] { return filament_per_mm(path[number]) * path[number].length_xy_mm; };
  while (laid_mm > path[number].filament_mm + lays_mm() && number + 1 < path.end()) {
    lag_mm -= counts() ? path[number].length_xy_mm - along_mm : 0.0;
    along_mm = 0.0;
    ++number;
  }
  const double per_mm = filament_per_mm(path[number]);
  if (per_mm <= 0.0) {
    return lag_mm;
  }
  const double laid_along_mm = (laid_mm - path[number].filament_mm) / per_mm;
  return lag_mm + along_mm - std::clamp(laid_along_mm, 0.0, path[number].length_xy_mm);
}

}  // namespace

void FilamentLag::add(const ReferencePath& path, std::size_t current, double r_x_mm, double r_y_mm,
                      double p_x_mm, double p_y_mm, double laid_mm, bool flows, double h) {
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
  if (!path[nearest].extruding && !flows) {
    return;
  }
  const double lag_mm = laid_lag_mm(path, nearest, best.along_mm, laid_mm);
  sum_lag2_ += h * lag_mm * lag_mm;
  weight_s_ += h;
  if (std::abs(lag_mm) > largest_mm_) {
    largest_mm_ = std::abs(lag_mm);
    line_ = path[nearest].move.segment.line;
  }
}

LagStats FilamentLag::stats() const {
  return {weight_s_ > 0.0 ? std::sqrt(sum_lag2_ / weight_s_) : 0.0, largest_mm_, line_};
}

}  // namespace unflex::verify
