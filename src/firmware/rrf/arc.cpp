#include "arc.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "unflex/core/math.hpp"

namespace unflex::gcode {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
// src/Config/Configuration.h.
constexpr double kMaxDeviation_mm = 0.005;
constexpr double kMinSegment_mm = 0.02;
constexpr double kMaxSegment_mm = 1.0;
constexpr double kMaxSegmentsPerSecond = 200.0;

// Angle travelled, positive in either direction. A full circle if start and end are equal as 32 bit
// numbers.
double angle_of(const Arc& arc) {
  const auto same = [](double one, double other) {
    return static_cast<float>(one) == static_cast<float>(other);
  };
  if (same(arc.start_mm[0], arc.end_mm[0]) && same(arc.start_mm[1], arc.end_mm[1])) {
    return kTurn;
  }
  const auto [i, j] = arc.centre_offset_mm;
  const double first = math::atan2(-j, -i);
  const double last =
      math::atan2(arc.end_mm[1] - arc.start_mm[1] - j, arc.end_mm[0] - arc.start_mm[0] - i);
  const double angle = arc.clockwise ? first - last : last - first;
  return angle < 0.0 ? angle + kTurn : angle;
}

// Computed in 32 bits as in the firmware, because the count can depend on rounding.
double segment_count(double radius_mm, double angle, double feed_mm_s) {
  const auto radius = static_cast<float>(radius_mm);
  const float by_deviation = std::sqrt(8.0F * radius * static_cast<float>(kMaxDeviation_mm));
  const auto by_speed = static_cast<float>(feed_mm_s / kMaxSegmentsPerSecond);
  const float length =
      std::clamp(std::min(by_deviation, by_speed), static_cast<float>(kMinSegment_mm),
                 static_cast<float>(kMaxSegment_mm));
  const float count = radius * static_cast<float>(angle) / length + 0.8F;
  return std::max(1.0, std::floor(static_cast<double>(count)));
}

}  // namespace

ArcPieces plan_rrf_arc(const Arc& arc, double feed_mm_s) {
  const auto [i, j] = arc.centre_offset_mm;
  const double radius_mm = math::hypot(i, j);
  const double angle = angle_of(arc);
  const double count = segment_count(radius_mm, angle, feed_mm_s);
  if (!(count <= kMostArcPieces)) {
    return std::nullopt;
  }
  const double first = math::atan2(-j, -i);
  const double step = (arc.clockwise ? -angle : angle) / count;
  std::vector<ArcPiece> pieces(static_cast<std::size_t>(count));
  for (std::size_t n = 1; n < pieces.size(); ++n) {
    const double at = first + static_cast<double>(n) * step;
    pieces[n - 1] = {{arc.start_mm[0] + i + radius_mm * math::cos(at),
                      arc.start_mm[1] + j + radius_mm * math::sin(at)},
                     static_cast<double>(n) / count};
  }
  pieces.back() = {{arc.end_mm[0], arc.end_mm[1]}, 1.0};
  return pieces;
}

}  // namespace unflex::gcode
