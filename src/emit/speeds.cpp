// Notation:
//   d, T  a line's length after rounding, and its time      A  the firmware's acceleration
//   c     time in the firmware's own plan, over the time by the formula
//   s     length of a step, where a line has a lead: its first step is made at v_prev
//
//   v = c (d + ((v − v_prev)₊² + (v − v_next)₊²) / 2A) / T
//   v = c (d − s + (v − v_next)₊² / 2A) / (T − s / v_prev)     with a lead
//
// A line as fast as or slower than its neighbours has no ramp. c is 1 except for what only the
// firmware's planner knows: junctions it slows down for, speeds it rounds to whole steps.
//
// A lead out of a standstill takes the same time for every run. The motors rest until its end, so
// all lines come that much later.
#include "speeds.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>

#include "dialect.hpp"
#include "filament_flow.hpp"
#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/math.hpp"
#include "unflex/core/number.hpp"

namespace unflex::emit {
namespace {

using gcode::E;
using gcode::Z;

// The ramps are short against the lines, so a few rounds over the neighbours settle them.
constexpr int kRampRounds = 6;
// Plans by the firmware's own rules. Each uses the corrections c of the plan before.
constexpr int kRounds = 3;
// Share of its time by which a line may be shortened or lengthened, to make up for lines before it.
constexpr double kMostCatchUp = 0.2;
// Share of the acceleration limit that this catching up may use.
constexpr double kCatchUpAccel = 0.05;
// One plan may change a speed by this factor at most, since the reason may have been a neighbour.
constexpr double kMostCorrection = 2.0;

// Before and after the lines of a part, the firmware is taken to be on a straight line that lasts
// this long.
constexpr double kPassing_s = 0.05;
constexpr std::size_t kNoStroke = std::numeric_limits<std::size_t>::max();

double magnitude(const std::optional<XY>& velocity_mm_s) {
  return velocity_mm_s ? length(*velocity_mm_s) : 0.0;
}

// The line that leads to `next` (side = −1) or away from it (side = 1), with that velocity and as
// much filament per mm as `next`.
gcode::Segment passing_line(const gcode::Segment& next, const XY& velocity_mm_s, double side) {
  gcode::Segment line;
  gcode::Position& near = side < 0.0 ? line.end_mm : line.start_mm;
  gcode::Position& far = side < 0.0 ? line.start_mm : line.end_mm;
  near = side < 0.0 ? next.start_mm : next.end_mm;
  far = near;
  set_xy(far, xy_of(far) + side * kPassing_s * velocity_mm_s);
  line.feed_mm_s = length(velocity_mm_s);
  if (next.length_xy_mm() > 0.0) {
    far[E] += side * kPassing_s * line.feed_mm_s * next.delta(E) / next.length_xy_mm();
  }
  line.line = kNoStroke;
  line.start_known = true;
  return line;
}

// Digits of F in mm/min that keep a line's duration within 0.05 %, and within 0.1 ms.
int feed_decimals(double feed_mm_min, double duration_s) {
  constexpr double kLate_s = 1e-4;
  constexpr int kMost = 8;
  int decimals = feed_mm_min >= 1000.0 ? 0 : feed_mm_min >= 100.0 ? 1 : feed_mm_min >= 1.0 ? 3 : 8;
  while (decimals < kMost && 0.5 / power_of_ten(decimals) * duration_s > kLate_s * feed_mm_min) {
    ++decimals;
  }
  return decimals;
}

// Marlin's reading of E while the lines are written: the sum of their words in single precision
// (Emitter::write_stroke, keep_reading_of_e_within).
class ReadingOfE {
 public:
  // The reading at both ends of the line. e_mm: the filament laid at its end.
  gcode::ReadingOfE until(double e_mm) {
    if (std::abs(mm_) > kMostReadingOfE_mm) {
      mm_ = 0.0;
      single_ = 0.0F;
    }
    const double word_mm = static_cast<double>(to_scaled(e_mm - written_mm_, kFilamentDecimals)) /
                           power_of_ten(kFilamentDecimals);
    gcode::ReadingOfE reading{.start = single_};
    written_mm_ += word_mm;
    mm_ += word_mm;
    single_ += static_cast<float>(word_mm);
    reading.end = single_;
    return reading;
  }

 private:
  double written_mm_ = 0.0;
  double mm_ = 0.0;
  float single_ = 0.0F;
};

// Tells when the firmware, by its own plan, will have done the lines it has been given. wait_s: how
// long it rests before the first line, which does not count. holds_last: the last line may still
// change, so the firmware gets it with the next one.
class FirmwareClock {
 public:
  FirmwareClock(std::unique_ptr<planner::Planner> firmware, double start_s, double wait_s,
                bool holds_last)
      : firmware_(std::move(firmware)),
        final_s_(start_s),
        wait_s_(wait_s),
        holds_last_(holds_last) {}

  // Lines are numbered from 0. expected_s: duration that is assumed for the line until the plan has
  // it.
  void add(const gcode::Segment& line, double expected_s) {
    give_last();
    last_ = line;
    durations_s_.push_back(expected_s);
    expected_s_ += expected_s;
    if (!holds_last_) {
      give_last();
    }
    take();
  }
  // The last line that was added has another speed. For a clock that holds it.
  void change_last(double speed_mm_s) {
    if (!last_ || last_->feed_mm_s == speed_mm_s) {
      return;
    }
    double& duration_s = durations_s_.back();
    expected_s_ -= duration_s;
    duration_s *= last_->feed_mm_s / speed_mm_s;
    expected_s_ += duration_s;
    last_->feed_mm_s = speed_mm_s;
  }
  // A line that does not belong to the run.
  void pass(const gcode::Segment& line) {
    give_last();
    firmware_->add(line);
  }
  void finish() {
    give_last();
    firmware_->stop();
    take();
  }

  [[nodiscard]] double now_s() const { return final_s_ + expected_s_; }
  [[nodiscard]] double duration_s(std::size_t line) const { return durations_s_[line]; }

 private:
  void give_last() {
    if (last_) {
      firmware_->add(*last_);
      last_.reset();
    }
  }

  void take() {
    moves_.clear();
    firmware_->take_played(moves_);
    for (const planner::PlannedMove& move : moves_) {
      if (move.segment.line != kNoStroke) {
        double& duration_s = durations_s_[move.segment.line];
        expected_s_ -= duration_s;
        duration_s = move.duration_s() - (move.segment.line == 0 ? wait_s_ : 0.0);
        final_s_ += duration_s;
      }
    }
  }

  std::unique_ptr<planner::Planner> firmware_;
  std::vector<planner::PlannedMove> moves_;
  std::vector<double> durations_s_;  // of the planned lines, then of the expected ones
  double final_s_;
  double wait_s_;
  bool holds_last_;
  std::optional<gcode::Segment> last_;  // not given to the firmware yet
  double expected_s_ = 0.0;
};

class SpeedSolver {
 public:
  SpeedSolver(const gcode::Position& start_mm, const Passing& passing, const EmitOptions& options,
              const Grid& grid, std::vector<Stroke>& strokes)
      : start_mm_(start_mm),
        passing_(passing),
        options_(&options),
        strokes_(&strokes),
        mm_s_per_feed_(grid.speed_factor / 60.0),
        zeroes_e_(grid.zeroes_e),
        distance_mm_(strokes.size()),
        accel_mm_s2_(strokes.size(), options.line_accel_mm_s2),
        step_events_(strokes.size(), 0.0),
        correction_(strokes.size(), 1.0),
        speed_mm_s_(strokes.size()) {
    const double z_accel_mm_s2 = z_limits(options.fixed, options.run_limits).accel_mm_s2;
    gcode::Position at = start_mm;
    at[E] = 0.0;
    for (std::size_t i = 0; i < strokes.size(); ++i) {
      const Stroke& stroke = strokes[i];
      const double dz = stroke.z_mm - at[Z];
      distance_mm_[i] = math::hypot(distance(xy_of(at), stroke.place_mm), dz);
      if (dz != 0.0) {
        accel_mm_s2_[i] = std::min(accel_mm_s2_[i], z_accel_mm_s2 * distance_mm_[i] / std::abs(dz));
      }
      const double de = stroke.e_mm - at[E];
      if (de < 0.0) {
        accel_mm_s2_[i] = std::min(
            accel_mm_s2_[i], drawing_back_mm_s2(options.fixed) * distance_mm_[i] / std::abs(de));
      }
      const gcode::Position to = stroke.end_mm();
      for (std::size_t axis = 0;
           spec_of(options.fixed.firmware).motion.counts_step_events && axis < to.size(); ++axis) {
        const double steps_per_mm = options.fixed.steps_per_mm[axis];
        step_events_[i] = std::max(step_events_[i], std::abs(std::round(to[axis] * steps_per_mm) -
                                                             std::round(at[axis] * steps_per_mm)));
      }
      at = to;
    }
  }

  // late_s: how late the first line begins.
  void solve(double late_s) {
    settle_ramps();
    for (int i = 0; i < kRounds; ++i) {
      round_to_feeds(late_s);
    }
  }

 private:
  void settle_ramps() {
    std::vector<double> next(strokes_->size());
    for (int round = 0; round <= kRampRounds; ++round) {
      for (std::size_t i = 0; i < next.size(); ++i) {
        const Lead lead = round > 0 ? lead_of(i, given_s(i)) : Lead{};
        next[i] =
            (distance_mm_[i] - lead.mm + (round > 0 ? ramps_mm(i) : 0.0)) / (given_s(i) - lead.s);
      }
      speed_mm_s_.swap(next);
    }
  }

  // The parts of a line's length and time that its lead takes.
  struct Lead {
    double mm = 0.0;
    double s = 0.0;
  };

  // The lead of line i, which is to take duration_s besides the wait for a run's first step. If
  // there is hardly time for it, the line takes longer, and the lines after it make up for that.
  [[nodiscard]] Lead lead_of(std::size_t i, double duration_s) const {
    constexpr double kMostOfLine = 0.7;
    const double before = speed_before(i);
    if (!leads(before) || speed_mm_s_[i] <= before || step_events_[i] < 2.0) {
      return {};
    }
    const double mm = distance_mm_[i] / step_events_[i];
    return {mm, before > 0.0 ? std::min(mm / before, kMostOfLine * duration_s) : 0.0};
  }

  // Whether a line may have a lead if the line before it has this speed. 0 stands for standstill.
  [[nodiscard]] bool leads(double before_mm_s) const {
    return before_mm_s > 0.0 ? options_->lines.leads : options_->lines.first_step_s > 0.0;
  }
  // How long a run that begins at rest waits for its first step.
  [[nodiscard]] double wait_s() const {
    return passing_.in_mm_s || passing_.kept_before ? 0.0 : options_->lines.first_step_s;
  }

  // Rounding and the firmware change the time that lines take. The next lines make up for that.
  void round_to_feeds(double late_s) {
    FirmwareClock clock(planner::make_planner(options_->run_limits, options_->fixed), late_s,
                        wait_s(), leaves_out_ramps());
    gcode::Segment line;
    line.end_mm = start_mm_;
    ReadingOfE reading;
    for (std::size_t i = 0; i < speed_mm_s_.size(); ++i) {
      Stroke& stroke = (*strokes_)[i];
      const double share = std::min(kMostCatchUp, kCatchUpAccel * options_->lines.max_accel_mm_s2 *
                                                      given_s(i) * given_s(i) / distance_mm_[i]);
      const double due_s = std::clamp(stroke.end_s - clock.now_s(), (1.0 - share) * given_s(i),
                                      (1.0 + share) * given_s(i));
      const Lead lead = lead_of(i, due_s);
      const double way_mm = correction_[i] * (distance_mm_[i] - lead.mm + ramps_mm(i));
      const double feed = way_mm / (due_s - lead.s) / mm_s_per_feed_;
      set_speed(i, feed * mm_s_per_feed_);
      if (i > 0) {
        clock.change_last(speed_mm_s_[i - 1]);  // which may depend on this one
      }
      gcode::Position to = stroke.end_mm();
      to[E] = start_mm_[E] + stroke.e_mm;
      line = {line.end_mm, to, stroke.speed_mm_s, i, true};
      if (zeroes_e_) {
        line.reading_of_e = reading.until(stroke.e_mm);
      }
      if (i == 0 && passing_.in_mm_s) {
        clock.pass(passing_line(line, *passing_.in_mm_s, -1.0));
      }
      if (i == 0 && passing_.kept_before) {
        gcode::Segment before = *passing_.kept_before;
        before.line = kNoStroke;
        clock.pass(before);
      }
      clock.add(line, lead.s + way_mm / speed_mm_s_[i]);
    }
    if (passing_.out_mm_s) {
      clock.pass(passing_line(line, *passing_.out_mm_s, 1.0));
    }
    clock.finish();
    for (std::size_t i = 0; i < speed_mm_s_.size(); ++i) {
      const Lead lead = lead_of(i, clock.duration_s(i));
      const double formula_s = (distance_mm_[i] - lead.mm + ramps_mm(i)) / speed_mm_s_[i];
      correction_[i] = std::clamp((clock.duration_s(i) - lead.s) / formula_s, 1.0 / kMostCorrection,
                                  kMostCorrection);
    }
  }

  [[nodiscard]] bool leaves_out_ramps() const {
    return spec_of(options_->fixed.firmware).motion.leaves_out_short_ramps;
  }

  // RepRapFirmware leaves out a line's ramp up from the faster of its two ends, and so goes no
  // faster than that end, if the ramp would take less than ten step clocks and gain less than 10 %
  // (DDA.cpp, RecalculateMove). Returns the least gain over `end_mm_s` with which the ramp stays,
  // and some room.
  [[nodiscard]] static double least_gain(double end_mm_s, double accel_mm_s2) {
    constexpr double kTenClocks_s = 10.0 / 750000.0;
    constexpr double kRoom = 1.05;
    return kRoom * std::min(accel_mm_s2 * kTenClocks_s, end_mm_s / 9.0);
  }

  // Whether a gain keeps the ramp. The least gain itself does, rounded as it is in F.
  [[nodiscard]] static bool is_enough(double gain_mm_s, double least_mm_s) {
    constexpr double kRounded = 0.99;
    return gain_mm_s >= kRounded * least_mm_s;
  }

  // The line before i is faster than v and so ends slower than it goes. If it began slower too, it
  // has two ramps, and must gain enough over the faster of its ends. Returns the speed nearest to v
  // with which it does. If there is none, the line before is given the speed that it will really
  // have.
  [[nodiscard]] double keeping_the_ramps_before(std::size_t i, double v) {
    const double before = speed_mm_s_[i - 1];
    const double began = speed_before(i - 1);
    if (began >= before) {
      return v;
    }
    const double faster_end = std::max(began, v);
    const double gain = least_gain(faster_end, accel_mm_s2_[i - 1]);
    if (is_enough(before - faster_end, gain)) {
      return v;
    }
    const double slower = before - gain;
    if (v > began && slower >= began) {
      return before - v < 0.5 * gain ? before : slower;
    }
    // However slow this line is, the line before gains too little over its own beginning.
    if (before - v < gain) {
      return before;
    }
    if (i > 1) {
      go_on_as_before(i - 1);
    }
    return v;
  }

  // The speed nearest to v at which the firmware leaves out no ramp.
  [[nodiscard]] double with_its_ramps(std::size_t i, double v) {
    const double before = speed_mm_s_[i - 1];
    if (v < before) {
      return keeping_the_ramps_before(i, v);
    }
    const double after = i + 1 < speed_mm_s_.size() ? speed_mm_s_[i + 1] : 0.0;
    const double faster_end = std::max(before, std::min(after, v));
    const double gain = least_gain(faster_end, accel_mm_s2_[i]);
    if (v == faster_end || is_enough(v - faster_end, gain)) {
      return v;
    }
    return v - faster_end < 0.5 * gain ? faster_end : faster_end + gain;
  }

  // Gives line i the speed of the line before it, to the last digit.
  void go_on_as_before(std::size_t i) {
    speed_mm_s_[i] = speed_mm_s_[i - 1];
    (*strokes_)[i].speed_mm_s = (*strokes_)[i - 1].speed_mm_s;
    (*strokes_)[i].feed_decimals = (*strokes_)[i - 1].feed_decimals;
  }

  // The speed nearest to v that the firmware can be told and will take.
  void set_speed(std::size_t i, double v) {
    Stroke& stroke = (*strokes_)[i];
    if (i > 0 && leaves_out_ramps()) {
      v = with_its_ramps(i, v);
      if (v == speed_mm_s_[i - 1]) {
        go_on_as_before(i);
        return;
      }
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
    // Marlin has whole steps per second, so that no more digits would help a long line.
    stroke.feed_decimals =
        step_events_[i] > 0.0 ? feed_decimals(feed, 0.0) + 1 : feed_decimals(feed, given_s(i));
    stroke.speed_mm_s =
        static_cast<double>(std::max<std::int64_t>(to_scaled(feed, stroke.feed_decimals), 1)) /
        power_of_ten(stroke.feed_decimals) * mm_s_per_feed_;
    speed_mm_s_[i] = step_events_[i] > 0.0 ? v : stroke.speed_mm_s;
  }

  // The time that stroke i is to take.
  [[nodiscard]] double given_s(std::size_t i) const {
    return (*strokes_)[i].end_s - (i > 0 ? (*strokes_)[i - 1].end_s : 0.0);
  }

  // The speed with which stroke i begins.
  [[nodiscard]] double speed_before(std::size_t i) const {
    if (i > 0) {
      return speed_mm_s_[i - 1];
    }
    return passing_.kept_before ? passing_.kept_before->feed_mm_s : magnitude(passing_.in_mm_s);
  }

  // The cost of the ramps of stroke i, as a distance at its speed.
  [[nodiscard]] double ramps_mm(std::size_t i) const {
    const double v = speed_mm_s_[i];
    const double after =
        i + 1 < speed_mm_s_.size() ? speed_mm_s_[i + 1] : magnitude(passing_.out_mm_s);
    // No ramp lasts longer than the line. Where a ramp would have to, the line takes longer, and
    // the lines after it make up for that.
    const double most = accel_mm_s2_[i] * given_s(i);
    const double before = speed_before(i);
    const double up = leads(before) ? 0.0 : std::clamp(v - before, 0.0, most);
    const double down = std::clamp(v - after, 0.0, most);
    return (up * up + down * down) / (2.0 * accel_mm_s2_[i]);
  }

  gcode::Position start_mm_;
  Passing passing_;
  const EmitOptions* options_;
  std::vector<Stroke>* strokes_;
  double mm_s_per_feed_;  // the speed that F1 means
  bool zeroes_e_;
  std::vector<double> distance_mm_;
  std::vector<double> accel_mm_s2_;
  std::vector<double> step_events_;  // Marlin: steps of the axis that has most of them
  std::vector<double> correction_;   // c
  std::vector<double> speed_mm_s_;
};

}  // namespace

void set_speeds(const gcode::Position& start_mm, const Passing& passing, const EmitOptions& options,
                const Grid& grid, double late_s, std::vector<Stroke>& strokes) {
  SpeedSolver(start_mm, passing, options, grid, strokes).solve(late_s);
}

}  // namespace unflex::emit
