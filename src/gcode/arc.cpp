#include "arc.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "unflex/core/math.hpp"

namespace unflex::gcode {
namespace {

// Within this distance start and end coincide, and the arc is a full circle. Klipper compares them
// exactly, after round-off in the angle, and so loses some full circles. But the file asks for the
// circle.
constexpr double kClosedWithin_mm = 1e-9;

double angle_travelled(const Arc& arc) {
  const double chord_alpha = arc.end_mm[0] - arc.start_mm[0];
  const double chord_beta = arc.end_mm[1] - arc.start_mm[1];
  if (math::hypot(chord_alpha, chord_beta) < kClosedWithin_mm) {
    return arc.clockwise ? -2.0 * std::numbers::pi : 2.0 * std::numbers::pi;
  }
  const auto [i, j] = arc.centre_offset_mm;
  const double end_alpha = chord_alpha - i;  // from the centre to the end
  const double end_beta = chord_beta - j;
  double angle = math::atan2(-i * end_beta + j * end_alpha, -i * end_alpha - j * end_beta);
  if (angle < 0.0) {
    angle += 2.0 * std::numbers::pi;
  }
  return arc.clockwise ? angle - 2.0 * std::numbers::pi : angle;
}

}  // namespace

ArcPieces plan_arc(const Arc& arc, double resolution_mm) {
  const auto [i, j] = arc.centre_offset_mm;
  const double angle = angle_travelled(arc);
  const double rise = arc.end_mm[2] - arc.start_mm[2];
  const double travel = math::hypot(math::hypot(i, j) * angle, rise);
  const double count = std::max(1.0, std::floor(travel / resolution_mm));
  if (!(count <= kMostArcPieces)) {
    return std::nullopt;
  }
  std::vector<ArcPiece> pieces(static_cast<std::size_t>(count));
  for (std::size_t n = 1; n < pieces.size(); ++n) {
    const double turned = static_cast<double>(n) * (angle / count);
    const double c = math::cos(turned);
    const double s = math::sin(turned);
    pieces[n - 1] = {{arc.start_mm[0] + i - i * c + j * s, arc.start_mm[1] + j - i * s - j * c},
                     static_cast<double>(n) / count};
  }
  pieces.back() = {{arc.end_mm[0], arc.end_mm[1]}, 1.0};
  return pieces;
}

std::optional<std::array<double, 2>> centre_from_radius(const std::array<double, 3>& start_mm,
                                                        const std::array<double, 3>& end_mm,
                                                        double radius_mm, bool clockwise) {
  const double half_alpha = 0.5 * (end_mm[0] - start_mm[0]);
  const double half_beta = 0.5 * (end_mm[1] - start_mm[1]);
  const double half_chord = math::hypot(half_alpha, half_beta);
  if (half_chord == 0.0) {
    return std::nullopt;
  }
  const double height =
      std::sqrt(std::max(0.0, (radius_mm - half_chord) * (radius_mm + half_chord)));
  const double side = clockwise != (radius_mm < 0.0) ? -1.0 : 1.0;
  const double scale = side * height / half_chord;
  return std::array<double, 2>{half_alpha - half_beta * scale, half_beta + half_alpha * scale};
}

}  // namespace unflex::gcode
