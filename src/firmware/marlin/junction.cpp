// Junction deviation, within an arc centripetal acceleration, and classic jerk.
//
// Source: Marlin 2.1.2, src/module/planner.cpp, Planner::_populate_block; planner.h,
// limit_value_by_axis_maximum.
//
//   u, w   unit vectors of the motors' motion in the block before and in this one; with E, if this
//          block takes filament
//   θ      angle at the junction, 0 for a reversal: cos θ = −u·w
//   δ      junction deviation
//   a_j    acceleration along w − u within the limits of the axes
#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include "marlin_block.hpp"
#include "marlin_junction.hpp"
#include "unflex/core/math.hpp"

namespace unflex::planner::marlin {
namespace {

using enum gcode::Axis;

// |cos θ| beyond this counts as a reversal, or as straight on.
constexpr float kStraight = 0.999999F;
// At a junction of more than 135° a block shorter than this counts as a piece of an arc
// (JD_HANDLE_SMALL_SEGMENTS).
constexpr float kShort_mm = 1.0F;
constexpr float kCosOctagon = -0.7071067812F;
// A lower speed counts as none.
constexpr float kNoSpeed_mm_s = 0.000001F;

float square(float x) { return x * x; }

void normalise(Vector& v) {
  float sum = 0.0F;
  for (const float x : v) sum += square(x);
  const float inverse = 1.0F / std::sqrt(sum);
  for (float& x : v) x *= inverse;
}

float junction_accel(const Settings& settings, float accel, const Vector& along) {
  for (std::size_t axis = 0; axis < along.size(); ++axis) {
    const auto limit = static_cast<float>(settings.max_accel_mm_s2[axis]);
    if (accel * std::abs(along[axis]) > limit) accel = std::abs(limit / along[axis]);
  }
  return accel;
}

float arccos(double t) {
  return static_cast<float>(math::atan2(std::sqrt((1.0 - t) * (1.0 + t)), t));
}

// arccos(t) for t in (0, 1) by chords of the curve, as the firmware has it by default
// (JD_USE_LOOKUP_TABLE): chord i spans 1 − 2⁻ⁱ to 1 − 2⁻⁽ⁱ⁺¹⁾, inner points raised so that the
// error is the same to both sides, ±0.01 rad at most. The chords are made in floats, because near t
// = 1 slope and offset cancel, and what rounding leaves of them is up to 1 % of the angle.
class ChordArccos {
 public:
  ChordArccos() {
    constexpr float kRaise = 1.00751495F;
    for (int i = 0; i < kChords; ++i) {
      const bool first = i == 0;
      const bool last = i + 1 == kChords;
      const float x0 = 1.0F - std::ldexp(1.0F, -i);
      const float x1 = last ? kStraight : 0.5F * x0 + 0.5F;
      const float y0 = arccos(x0) * (first ? 1.0F : kRaise);
      const float y1 = arccos(x1) * (last ? 1.0F : kRaise);
      chords_[static_cast<std::size_t>(i)] = {(y0 - y1) / (x0 - x1),
                                              (y1 * x0 - y0 * x1) / (x0 - x1)};
    }
  }

  [[nodiscard]] float operator()(float t) const {
    const auto scaled = static_cast<std::uint16_t>((1.0F - t) * kScale);
    const auto [slope, offset] = chords_[static_cast<std::size_t>(std::countl_zero(scaled) - 1)];
    return t * slope + offset;
  }

 private:
  static constexpr int kChords = 16;
  static constexpr float kScale = 32768.0F;  // 2^(kChords − 1)
  std::array<std::pair<float, float>, kChords> chords_;
};

// Squared speed on the arc of which the block is a chord: a_j times its radius, length / (π − θ).
float arc_v2(float length_mm, float accel, float cos_theta) {
  static const ChordArccos chord_arccos;
  return length_mm * accel / chord_arccos(-cos_theta);
}

float deviation_v2(const Settings& settings, const Block& block, float curve_radius_mm,
                   const Vector& u, const Vector& w) {
  float cos_theta = -u[E] * w[E] + -u[X] * w[X] + -u[Y] * w[Y] + -u[Z] * w[Z];
  if (cos_theta > kStraight) return square(settings.minimum_speed_mm_s);
  Vector along{};
  for (std::size_t axis = 0; axis < along.size(); ++axis) along[axis] = w[axis] - u[axis];
  normalise(along);
  const float accel = junction_accel(settings, block.accel_mm_s2, along);
  if (curve_radius_mm != 0.0F) return accel * curve_radius_mm;
  cos_theta = std::max(cos_theta, -kStraight);
  const float sin_half = std::sqrt(0.5F * (1.0F - cos_theta));
  const float v2 = accel * settings.junction_deviation_mm * sin_half / (1.0F - sin_half);
  if (!settings.handle_small_segments || block.length_mm >= kShort_mm || cos_theta >= kCosOctagon) {
    return v2;
  }
  return std::min(v2, arc_v2(block.length_mm, accel, cos_theta));
}

float junction_deviation_v2(const Settings& settings, const Block& block, const BlockEntry& entry,
                            bool joined, Previous& previous) {
  Vector unit = entry.distance_mm;
  // With E, or on shared motors, the vector is not as long as the head's travel.
  if (entry.with_filament || settings.shares_motors) {
    normalise(unit);
  } else {
    for (float& x : unit) x *= entry.inverse_length;
  }
  float v2 = 0.0F;
  if (joined) {
    v2 = std::min({deviation_v2(settings, block, entry.curve_radius_mm, previous.unit, unit),
                   square(block.nominal_speed_mm_s), square(previous.nominal_speed_mm_s)});
  }
  previous.unit = unit;
  return v2;
}

// The speed from which every axis can halt at once.
float safe_speed(const Settings& settings, const Block& block, const Vector& speed_mm_s) {
  float safe = block.nominal_speed_mm_s;
  bool limited = false;
  for (std::size_t axis = 0; axis < speed_mm_s.size(); ++axis) {
    const float jerk = std::abs(speed_mm_s[axis]);
    const float max_jerk = settings.jerk_mm_s[axis];
    if (jerk <= max_jerk) continue;
    if (!limited) {
      safe *= max_jerk / jerk;
      limited = true;
    } else if (jerk * safe > block.nominal_speed_mm_s * max_jerk) {
      safe = block.nominal_speed_mm_s * max_jerk / jerk;
    }
  }
  return safe;
}

// Sudden change of an axis' speed. An axis that reverses may halt first.
float axis_jerk(float exit, float entry) {
  const bool reverses =
      (exit > entry) ? !(entry > 0.0F || exit < 0.0F) : !(entry < 0.0F || exit > 0.0F);
  return reverses ? std::max(std::abs(exit), std::abs(entry)) : std::abs(exit - entry);
}

// Speed both blocks share at the junction.
float shared_speed(const Settings& settings, const Block& block, const Vector& speed_mm_s,
                   const Previous& previous) {
  float v = previous.nominal_speed_mm_s;
  float previous_factor = 1.0F;
  if (block.nominal_speed_mm_s < previous.nominal_speed_mm_s) {
    v = block.nominal_speed_mm_s;
    previous_factor = v / previous.nominal_speed_mm_s;
  }
  float factor = 1.0F;
  for (std::size_t axis = 0; axis < speed_mm_s.size(); ++axis) {
    const float jerk =
        axis_jerk(previous.speed_mm_s[axis] * previous_factor * factor, speed_mm_s[axis] * factor);
    if (jerk > settings.jerk_mm_s[axis]) factor *= settings.jerk_mm_s[axis] / jerk;
  }
  return v * factor;
}

float classic_jerk_v2(const Settings& settings, const Block& block, const BlockEntry& entry,
                      bool joined, Previous& previous) {
  const float safe = safe_speed(settings, block, entry.speed_mm_s);
  float v = safe;
  if (joined) {
    v = shared_speed(settings, block, entry.speed_mm_s, previous);
    const float threshold = v * 0.99F;
    if (previous.safe_speed_mm_s > threshold && safe > threshold) v = safe;
  }
  previous.safe_speed_mm_s = safe;
  return square(v);
}

}  // namespace

float max_entry_v2(const Settings& settings, const Block& block, const BlockEntry& entry,
                   Previous& previous) {
  const bool joined = entry.moving && previous.nominal_speed_mm_s >= kNoSpeed_mm_s;
  return settings.classic_jerk ? classic_jerk_v2(settings, block, entry, joined, previous)
                               : junction_deviation_v2(settings, block, entry, joined, previous);
}

}  // namespace unflex::planner::marlin
