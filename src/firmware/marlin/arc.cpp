// Marlin computes with 32 bit floats. The number of an arc's pieces can depend on their rounding,
// so it is computed in 32 bits here too. Places are computed in double.
#include "arc.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "unflex/core/math.hpp"

namespace unflex::gcode {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kMostPieces = 65535.0;  // uint16_t
// NEAR_ZERO of Marlin's core/macros.h.
constexpr double kSame_mm = 1e-6;
// A smaller angle counts as zero, as it would in 32 bits.
constexpr double kNoAngle = 1e-7;

bool is_closed(const Arc& arc) {
  return std::abs(arc.end_mm[0] - arc.start_mm[0]) < kSame_mm &&
         std::abs(arc.end_mm[1] - arc.start_mm[1]) < kSame_mm;
}

// Angle travelled, positive anticlockwise. 0: Marlin leaves the arc out.
double angle_of(const Arc& arc) {
  if (is_closed(arc)) {
    return arc.clockwise ? -kTurn : kTurn;
  }
  const double a = -arc.centre_offset_mm[0];
  const double b = -arc.centre_offset_mm[1];
  const double end_a = arc.end_mm[0] - arc.start_mm[0] + a;
  const double end_b = arc.end_mm[1] - arc.start_mm[1] + b;
  const double angle = math::atan2(a * end_b - b * end_a, a * end_a + b * end_b);
  if (std::abs(angle) < kNoAngle) {
    return 0.0;
  }
  if (angle > 0.0 && arc.clockwise) {
    return angle - kTurn;
  }
  return angle < 0.0 && !arc.clockwise ? angle + kTurn : angle;
}

float least_segments(float angle, bool closed, const MarlinArcs& rules) {
  const float whole = static_cast<float>(rules.min_circle_segments);
  return closed ? whole : std::ceil(whole * (angle / static_cast<float>(kTurn)));
}

float segment_count(double radius_mm, double abs_angle, bool closed, double feed_mm_s,
                    const MarlinArcs& rules) {
  const auto longest = static_cast<float>(rules.max_segment_mm);
  const auto shortest = static_cast<float>(rules.min_segment_mm);
  const auto angle = static_cast<float>(abs_angle);
  const float flat = static_cast<float>(radius_mm) * angle;
  float ideal = longest;
  if (rules.segments_per_s > 0.0) {
    ideal = std::clamp(static_cast<float>(feed_mm_s / rules.segments_per_s), shortest, longest);
  }
  const float nominal = std::max(std::floor(flat / ideal), least_segments(angle, closed, rules));
  const float nominal_length = flat / nominal;
  if (nominal_length > longest) {
    return std::ceil(flat / longest);
  }
  return nominal_length < shortest ? std::max(1.0F, std::floor(flat / shortest)) : nominal;
}

// One turn or part of a turn; `from` and `to` are shares of the whole.
void append_turn(const Arc& arc, double angle, bool closed, double from, double to,
                 double feed_mm_s, const MarlinArcs& rules, std::vector<ArcPiece>& pieces) {
  const auto [i, j] = arc.centre_offset_mm;
  const double count = static_cast<double>(
      segment_count(math::hypot(i, j), std::abs(angle), closed, feed_mm_s, rules));
  const double theta = angle / count;
  const double sine = theta - theta * theta * theta / 6.0;
  const double cosine = 1.0 - 0.5 * theta * theta;
  const int interval = std::max(1, rules.correction_interval);
  double a = -i;
  double b = -j;
  for (int n = 1; n < static_cast<int>(count); ++n) {
    if (n % interval != 0) {
      const double turned_b = a * sine + b * cosine;
      a = a * cosine - b * sine;
      b = turned_b;
    } else {
      const double c = math::cos(n * theta);
      const double s = math::sin(n * theta);
      a = -i * c + j * s;
      b = -i * s - j * c;
    }
    pieces.push_back(
        {{arc.start_mm[0] + i + a, arc.start_mm[1] + j + b}, from + (to - from) * (n / count)});
  }
}

}  // namespace

ArcPieces plan_marlin_arc(const Arc& arc, int circles, double feed_mm_s, const MarlinArcs& rules) {
  const double radius_mm = math::hypot(arc.centre_offset_mm[0], arc.centre_offset_mm[1]);
  const double turns = std::abs(angle_of(arc)) + circles * kTurn;
  if (!(radius_mm * turns / std::min(rules.min_segment_mm, rules.max_segment_mm) <= kMostPieces)) {
    return std::nullopt;
  }
  std::vector<ArcPiece> pieces;
  const double angle = angle_of(arc);
  if (angle == 0.0) {
    return pieces;
  }
  const double per_circle = kTurn / turns;
  for (int n = 0; n < circles; ++n) {
    const double whole = arc.clockwise ? -kTurn : kTurn;
    append_turn(arc, whole, true, n * per_circle, (n + 1) * per_circle, feed_mm_s, rules, pieces);
    pieces.push_back({{arc.start_mm[0], arc.start_mm[1]}, (n + 1) * per_circle});
  }
  append_turn(arc, angle, is_closed(arc), circles * per_circle, 1.0, feed_mm_s, rules, pieces);
  pieces.push_back({{arc.end_mm[0], arc.end_mm[1]}, 1.0});
  return pieces;
}

}  // namespace unflex::gcode
