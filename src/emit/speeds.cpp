// Notation:
//   d, T  a line's length after rounding, and its time      A  the firmware's acceleration
//   c     what the firmware's own plan takes, over what the formula says
//
//   v = c (d + ((v − v_prev)₊² + (v − v_next)₊²) / 2A) / T
//
// A line as fast as or slower than its neighbours has no ramp. c is 1 but for what only the
// firmware's planner knows: junctions it slows down for, speeds it rounds to whole steps.
#include "speeds.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>

#include "unflex/core/number.hpp"

namespace unflex::emit {
namespace {

using gcode::E;
using gcode::X;
using gcode::Y;
using gcode::Z;

// The ramps are short against the lines, so a few rounds over the neighbours settle them.
constexpr int kRampRounds = 6;
// Plans by the firmware's own rules, each with the speeds the last one asked for.
constexpr int kReplays = 2;
// How much of its time a line may be shortened or lengthened by, to make up for those before it.
constexpr double kMostCatchUp = 0.2;
// … and what of the acceleration limit may go into it.
constexpr double kCatchUpAccel = 0.05;
// What one plan may change a speed by: the reason may have been a neighbour.
constexpr double kMostCorrection = 2.0;

// Digits of F in mm/min that keep a line's duration within 0.05 %.
int feed_decimals(double feed_mm_min) {
  if (feed_mm_min >= 1000.0) {
    return 0;
  }
  if (feed_mm_min >= 100.0) {
    return 1;
  }
  return feed_mm_min >= 1.0 ? 3 : 8;
}

class SpeedSolver {
 public:
  SpeedSolver(const gcode::Position& start_mm, const EmitOptions& options, double mm_s_per_feed,
              std::vector<Stroke>& strokes)
      : start_mm_(start_mm),
        options_(&options),
        strokes_(&strokes),
        mm_s_per_feed_(mm_s_per_feed),
        distance_mm_(strokes.size()),
        accel_mm_s2_(strokes.size(), options.line_accel_mm_s2),
        step_events_(strokes.size(), 0.0),
        correction_(strokes.size(), 1.0),
        speed_mm_s_(strokes.size()) {
    const double z_accel_mm_s2 = options.fixed.firmware == Firmware::klipper
                                     ? options.fixed.max_z_accel_mm_s2
                                     : options.run_limits.axis_max_accel_mm_s2[Z];
    gcode::Position at = start_mm;
    at[E] = 0.0;
    for (std::size_t i = 0; i < strokes.size(); ++i) {
      const Stroke& stroke = strokes[i];
      const double dz = stroke.z_mm - at[Z];
      distance_mm_[i] = std::hypot(stroke.x_mm - at[X], stroke.y_mm - at[Y], dz);
      if (dz != 0.0) {
        accel_mm_s2_[i] = std::min(accel_mm_s2_[i], z_accel_mm_s2 * distance_mm_[i] / std::abs(dz));
      }
      const gcode::Position to = {stroke.x_mm, stroke.y_mm, stroke.z_mm, stroke.e_mm};
      for (std::size_t axis = 0; options.fixed.firmware == Firmware::marlin && axis < to.size();
           ++axis) {
        const double steps_per_mm = options.fixed.steps_per_mm[axis];
        step_events_[i] = std::max(step_events_[i], std::abs(std::round(to[axis] * steps_per_mm) -
                                                             std::round(at[axis] * steps_per_mm)));
      }
      at = to;
    }
  }

  void solve() {
    settle_ramps();
    round_to_feeds();
    for (int i = 0; i < kReplays; ++i) {
      compare_with_firmware();
      round_to_feeds();
    }
  }

 private:
  void settle_ramps() {
    std::vector<double> next(strokes_->size());
    for (int round = 0; round <= kRampRounds; ++round) {
      double start_s = 0.0;
      for (std::size_t i = 0; i < next.size(); ++i) {
        const double end_s = (*strokes_)[i].end_s;
        next[i] = (distance_mm_[i] + (round > 0 ? ramps_mm(i) : 0.0)) / (end_s - start_s);
        start_s = end_s;
      }
      speed_mm_s_.swap(next);
    }
  }

  // What rounding does to the clock the next line makes up for.
  void round_to_feeds() {
    double clock_s = 0.0;
    for (std::size_t i = 0; i < speed_mm_s_.size(); ++i) {
      Stroke& stroke = (*strokes_)[i];
      const double given_s = stroke.end_s - (i > 0 ? (*strokes_)[i - 1].end_s : 0.0);
      const double share = std::min(kMostCatchUp, kCatchUpAccel * options_->lines.max_accel_mm_s2 *
                                                      given_s * given_s / distance_mm_[i]);
      const double due_s =
          std::clamp(stroke.end_s - clock_s, (1.0 - share) * given_s, (1.0 + share) * given_s);
      const double way_mm = correction_[i] * (distance_mm_[i] + ramps_mm(i));
      const double feed = way_mm / due_s / mm_s_per_feed_;
      set_speed(i, feed * mm_s_per_feed_);
      clock_s += way_mm / speed_mm_s_[i];
    }
  }

  // RepRapFirmware leaves out ramps of less than ten step clocks if the speed is there within 10 %
  // (DDA.cpp, RecalculateMove), and both moves then go at the lower speed. The least change from
  // `before` that it does not leave out.
  [[nodiscard]] static double least_change(double before, double accel_mm_s2) {
    constexpr double kTenClocks_s = 10.0 / 750000.0;
    constexpr double kRoom = 1.05;
    return kRoom * std::min(accel_mm_s2 * kTenClocks_s, 0.1 * before);
  }
  [[nodiscard]] bool is_lost(double v, double before, double accel_mm_s2) const {
    return options_->fixed.firmware == Firmware::rrf && v != before &&
           std::abs(v - before) < least_change(before, accel_mm_s2);
  }

  // The speed nearest to v that the firmware can be told and will take.
  void set_speed(std::size_t i, double v) {
    Stroke& stroke = (*strokes_)[i];
    if (i > 0 && is_lost(v, speed_mm_s_[i - 1], accel_mm_s2_[i])) {
      const double before = speed_mm_s_[i - 1];
      const double kept = std::copysign(least_change(before, accel_mm_s2_[i]), v - before);
      if (std::abs(v - before) < 0.5 * std::abs(kept)) {
        stroke.speed_mm_s = speed_mm_s_[i] = before;
        stroke.feed_decimals = (*strokes_)[i - 1].feed_decimals;
        return;
      }
      v = before + kept;
    }
    double told = v;
    if (step_events_[i] > 0.0) {
      // Marlin rounds up to whole steps per second (planner.cpp, _populate_block: nominal_rate).
      const double mm_per_step_event = distance_mm_[i] / step_events_[i];
      const double rate = std::max(std::round(v / mm_per_step_event), 1.0);
      v = rate * mm_per_step_event;
      told = (rate - 0.5) * mm_per_step_event;
    }
    const double feed = told / mm_s_per_feed_;
    stroke.feed_decimals = feed_decimals(feed) + (step_events_[i] > 0.0 ? 1 : 0);
    stroke.speed_mm_s =
        static_cast<double>(std::max<std::int64_t>(to_scaled(feed, stroke.feed_decimals), 1)) /
        power_of_ten(stroke.feed_decimals) * mm_s_per_feed_;
    speed_mm_s_[i] = step_events_[i] > 0.0 ? v : stroke.speed_mm_s;
  }

  void compare_with_firmware() {
    const std::unique_ptr<planner::Planner> firmware =
        planner::make_planner(options_->run_limits, options_->fixed);
    gcode::Position at = start_mm_;
    for (std::size_t i = 0; i < strokes_->size(); ++i) {
      const Stroke& stroke = (*strokes_)[i];
      const gcode::Position to = {stroke.x_mm, stroke.y_mm, stroke.z_mm,
                                  start_mm_[gcode::E] + stroke.e_mm};
      firmware->add({at, to, stroke.speed_mm_s, i, true});
      at = to;
    }
    firmware->stop();
    std::vector<planner::PlannedMove> moves;
    firmware->take(moves);
    for (const planner::PlannedMove& move : moves) {
      const std::size_t i = move.segment.line;
      const double expected_s = (distance_mm_[i] + ramps_mm(i)) / speed_mm_s_[i];
      correction_[i] =
          std::clamp(move.duration_s() / expected_s, 1.0 / kMostCorrection, kMostCorrection);
    }
  }

  // What the ramps of stroke i cost, as distance at its speed.
  [[nodiscard]] double ramps_mm(std::size_t i) const {
    const double v = speed_mm_s_[i];
    const double up = std::max(v - (i > 0 ? speed_mm_s_[i - 1] : 0.0), 0.0);
    const double down = std::max(v - (i + 1 < speed_mm_s_.size() ? speed_mm_s_[i + 1] : 0.0), 0.0);
    return (up * up + down * down) / (2.0 * accel_mm_s2_[i]);
  }

  gcode::Position start_mm_;
  const EmitOptions* options_;
  std::vector<Stroke>* strokes_;
  double mm_s_per_feed_;
  std::vector<double> distance_mm_;
  std::vector<double> accel_mm_s2_;
  std::vector<double> step_events_;  // Marlin: of the axis with most steps
  std::vector<double> correction_;   // c
  std::vector<double> speed_mm_s_;
};

}  // namespace

void set_speeds(const gcode::Position& start_mm, const EmitOptions& options, double mm_s_per_feed,
                std::vector<Stroke>& strokes) {
  SpeedSolver(start_mm, options, mm_s_per_feed, strokes).solve();
}

}  // namespace unflex::emit
