#include "section_rules.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

namespace unflex::verify {
namespace {

// One more line within 100 ms is allowed: the clock's last digits may decide that.
constexpr double kOneLine_per_s = 10.0;
// Allowance for rounding to steps and for how far the nozzle strays.
constexpr double kRounding_mm = 0.05;
// Filament that a line in the tail may lay in any case. Where the timing is free, a nozzle that
// turns round in the end may have passed all of the path before its base has made all of its way.
constexpr double kLate_mm = 5e-4;
constexpr double kLateInFreeTiming_mm = 2e-3;
// Shorter lines do not tell how much filament is laid per path.
constexpr double kShort_mm = 0.2;
// A line may lay this much more per path than the densest one, since lengths are rounded.
constexpr double kDenser = 1.25;
// In a tail the nozzle lays nothing. So it may swing more there than if the run had been kept: by
// this factor, or up to this much.
constexpr double kTimesInTail = 2.2;
constexpr double kLittleSwing_mm = 80e-3;

double speed_mm_s(const planner::PlannedMove& move) {
  return move.duration_s() > 0.0 ? move.segment.length_xy_mm() / move.duration_s() : 0.0;
}

}  // namespace

double SectionRules::largest_offset_mm(double max_accel_mm_s2, double v_mm_s) const {
  // Where the timing is free, the spring may throw the nozzle round a corner faster than the base
  // could.
  constexpr double kTimesInFreeTiming = 2.5;
  const XY lag_mm = map_axes(
      [&](const dynamics::FlexibleAxis& axis) {
        return axis.largest_lag_mm(max_accel_mm_s2, v_mm_s);
      },
      rules_->nozzle);
  return kRounding_mm + (has_free_timing_ ? kTimesInFreeTiming : 1.0) * length(lag_mm);
}

void SectionRules::Breach::offer(double a_value, double limit, std::size_t a_line) {
  if (line == 0 && a_value > limit) {
    value = a_value;
    line = a_line;
  }
}

void SectionRules::begin(const LineRate& rate_before, bool ringing, bool has_free_timing) {
  ringing_ = ringing;
  has_free_timing_ = has_free_timing;
  densest_ = 0.0;
  sliced_rate_ = rate_before;
  sliced_rate_.forget();
  sliced_rate_.change_text();
  first_line_ = 0;
  offset_ = {};
  filament_in_tail_ = {};
  swing_in_tail_mm_ = 0.0;
  swing_line_ = 0;
}

void SectionRules::add(const planner::PlannedMove& move, Meter& meter, bool late,
                       double filament_tolerance_mm) {
  const std::size_t line = move.segment.line;
  first_line_ = first_line_ == 0 ? line : first_line_;
  last_line_ = line;
  const double offset_mm = meter.base_offset_mm();
  const double v_mm_s = speed_mm_s(move);
  const double over_mm = offset_mm - largest_offset_mm(rules_->base_max_accel_mm_s2, v_mm_s);
  if (over_mm > offset_.over_mm) {
    offset_ = {over_mm, offset_mm, v_mm_s, line};
  }
  // Filament that a wipe pulls back does not matter.
  const double filament_mm = std::max(0.0, move.segment.delta(gcode::E));
  if (!late && move.segment.length_xy_mm() > kShort_mm) {
    densest_ = std::max(densest_, filament_mm / move.segment.length_xy_mm());
  }
  if (late) {
    // If the run's clock is late, some of its path is still to go.
    const double to_go_mm = meter.to_path_end_mm(move.segment.start_mm);
    filament_in_tail_.offer(filament_mm,
                            (has_free_timing_ ? kLateInFreeTiming_mm : kLate_mm) +
                                filament_tolerance_mm + kDenser * densest_ * to_go_mm,
                            line);
    const double swing_mm = meter.swing_mm();
    if (swing_mm > swing_in_tail_mm_) {
      swing_in_tail_mm_ = swing_mm;
      swing_line_ = line;
    }
  }
}

void SectionRules::end(const LineRate& rate, const Meter& kept, const Meter& emitted,
                       double base_max_accel_mm_s2) {
  check_rate(rate);
  check_nozzle(kept, emitted);
  // The firmware may pass from kept motion into the run without a stop, but the run was written to
  // begin at rest. So its ringing is not known exactly, and its swing is not checked.
  if (!ringing_) {
    check_swing(kept, emitted);
  }
  check_filament();
  if (offset_.value_mm > largest_offset_mm(base_max_accel_mm_s2, offset_.speed_mm_s)) {
    violations_->in_output(
        offset_.line,
        fmt::format("the base is {:.3f} mm away from the sliced path", offset_.value_mm));
  }
}

void SectionRules::check_filament() {
  if (filament_in_tail_.line != 0) {
    violations_->in_output(filament_in_tail_.line,
                           fmt::format("{:.5f} mm of filament in the tail of a run, after all that "
                                       "the sliced file lays",
                                       filament_in_tail_.value));
  }
}

void SectionRules::check_swing(const Meter& kept, const Meter& emitted) {
  if (emitted.swing_mm() > swing_in_tail_mm_) {
    swing_in_tail_mm_ = emitted.swing_mm();
    swing_line_ = last_line_;
  }
  const double kept_mm = kept.swing_mm();
  if (swing_in_tail_mm_ > std::max(kTimesInTail * kept_mm, kLittleSwing_mm)) {
    violations_->in_output(
        swing_line_, fmt::format("in the tail of a run the nozzle swings by {:.3f} µm instead of "
                                 "{:.3f} µm as sliced",
                                 swing_in_tail_mm_ * 1e3, kept_mm * 1e3));
  }
}

void SectionRules::check_rate(const LineRate& rate) {
  const double most = std::max(rules_->max_lines_per_s, sliced_rate_.max_per_s()) + kOneLine_per_s;
  if (rate.max_per_s() > most) {
    violations_->in_output(rate.densest_line(),
                           fmt::format("{:.0f} lines per second are more than {:.0f}",
                                       rate.max_per_s(), rules_->max_lines_per_s));
  }
}

void SectionRules::check_nozzle(const Meter& kept, const Meter& emitted) {
  const auto error_of = [&](const Meter& meter) {
    const SectionError& error = meter.section_error();
    return run_error(error.rms_mm() * error.rms_mm() * error.duration_s(), error.max_mm(),
                     error.duration_s(), meter.swing_mm(), rules_->nozzle);
  };
  const Leeway& leeway = rules_->leeway;
  // Where the timing is free, the nozzle may use the tolerance.
  const double tolerance_mm = has_free_timing_ ? rules_->tolerance_mm : 0.0;
  const RunError before = error_of(kept);
  const RunError after = error_of(emitted);
  if (after.rms_mm > std::max({leeway.times * before.rms_mm, leeway.rms_mm, tolerance_mm}) ||
      after.max_mm > std::max({leeway.times * before.max_mm + leeway.chance_mm, leeway.max_mm,
                               kTimesTolerance * tolerance_mm})) {
    violations_->in_output(
        first_line_,
        fmt::format(
            "in this run the nozzle strays more than in the sliced file (line {}): with the "
            "swing that is left, contour RMS {:.3f} instead of {:.3f} µm, largest {:.3f} "
            "instead of {:.3f} µm",
            emitted.section_error().line(), after.rms_mm * 1e3, before.rms_mm * 1e3,
            after.max_mm * 1e3, before.max_mm * 1e3));
  }
}

}  // namespace unflex::verify
