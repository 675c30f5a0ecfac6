#include "filament_lag.hpp"

#include <algorithm>
#include <cmath>

#include "rounding.hpp"

namespace unflex::verify {
namespace {

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

void FilamentLag::add(const ReferencePath& path, const PathPlace& nozzle, double laid_mm,
                      bool flows, double h) {
  if (!path[nozzle.piece].extruding && !flows) {
    return;
  }
  const double lag_mm = laid_lag_mm(path, nozzle.piece, nozzle.along_mm, laid_mm);
  sum_lag2_ += h * lag_mm * lag_mm;
  weight_s_ += h;
  if (std::abs(lag_mm) > largest_mm_) {
    largest_mm_ = std::abs(lag_mm);
    line_ = path[nozzle.piece].move.segment.line;
  }
}

LagStats FilamentLag::stats() const {
  return {weight_s_ > 0.0 ? std::sqrt(sum_lag2_ / weight_s_) : 0.0, largest_mm_, line_};
}

}  // namespace unflex::verify
