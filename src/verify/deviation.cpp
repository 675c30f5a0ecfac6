#include "unflex/verify/deviation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "meter.hpp"
#include "unflex/core/math.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

DeviationStats DeviationAccumulator::stats() const {
  DeviationStats stats;
  if (weight_s_ <= 0.0) {
    return stats;
  }
  stats.contour_max_mm = std::sqrt(contour2_max_);
  stats.contour_p99_mm = std::min(stats.contour_max_mm, contour_s_.quantile(0.99));
  stats.contour_p999_mm = std::min(stats.contour_max_mm, contour_s_.quantile(0.999));
  stats.contour_rms_mm = std::sqrt(sum_contour2_ / weight_s_);
  stats.tracking_max_mm = std::sqrt(tracking2_max_);
  stats.tracking_rms_mm = std::sqrt(sum_tracking2_ / weight_s_);
  stats.duration_s = weight_s_;
  stats.contour_max_line = line_;
  return stats;
}

NozzleModel coarse(NozzleModel model) {
  constexpr double kSamplesPerPeriod = 20.0;
  const double fastest_rad_s =
      most_of_axes([](const dynamics::FlexibleAxis& axis) { return axis.fastest_rad_s(); }, model);
  model.step_s =
      std::max(model.step_s, 2.0 * std::numbers::pi / (kSamplesPerPeriod * fastest_rad_s));
  return model;
}

NozzleXY riding(const NozzleModel& model, const XY& place_mm, const XY& velocity_mm_s) {
  return model.frame ? model.frame->riding({velocity_mm_s.x, velocity_mm_s.y, 0.0})
                     : dynamics::riding(model, place_mm, velocity_mm_s);
}

double apart_mm(const NozzleXY& a, const NozzleXY& b, const NozzleModel& model) {
  if (model.frame) {
    return model.frame->apart_mm(a, b);
  }
  return length(map_axes(
      [](const dynamics::FlexibleAxis& axis, const dynamics::NozzleState& of_a,
         const dynamics::NozzleState& of_b) {
        const dynamics::FlexibleAxis::Gap gap = axis.gap(of_a, of_b);
        return math::hypot(gap.place_mm, gap.speed_mm);
      },
      model, a, b));
}

double swing_mm(const NozzleXY& nozzle, const gcode::Position& at, const NozzleModel& model) {
  return apart_mm(nozzle, riding(model, xy_of(at)), model);
}

RunError run_error(double contour2_mm2_s, double contour_max_mm, double duration_s, double swing_mm,
                   const NozzleModel& model) {
  if (duration_s <= 0.0) {
    return {};
  }
  // A lower limit, because an undamped swing would count for ever.
  static constexpr double kLeastDamping = 0.01;
  const double left_mm2_s =
      swing_mm * swing_mm *
      most_of_axes([](const dynamics::FlexibleAxis& axis) { return axis.ringing_s(kLeastDamping); },
                   model);
  return {std::sqrt((contour2_mm2_s + left_mm2_s) / duration_s),
          std::max(contour_max_mm, swing_mm)};
}

RunDeviation measure(const std::vector<planner::PlannedMove>& reference,
                     const std::vector<planner::PlannedMove>& base, NozzleXY start,
                     const NozzleModel& model, const MachineChange& change, double lead_in_s,
                     bool goes_on) {
  std::size_t taken = 0;
  ReferencePath path([&](ReferenceMove& next) {
    if (taken == reference.size()) {
      return false;
    }
    next.move = reference[taken++];
    return true;
  });
  path.begin_section(lead_in_s);
  Meter meter(model);
  meter.begin_section(path);
  if (base.empty() && reference.empty()) {
    meter.set_state(start, dynamics::place_mm(start));
  } else {
    const planner::PlannedMove& first = base.empty() ? reference.front() : base.front();
    meter.set_state(start, xy_of(first.segment.start_mm));
  }
  meter.look();
  for (const planner::PlannedMove& move : base) {
    if (change.acts()) {
      meter.set_machine(change, move.segment.start_mm);
    }
    meter.play(move);
    path.discard_before(meter.time_s() - meter.reach_s());
  }
  if (!goes_on) {
    meter.wait_for_reference();
  }

  RunDeviation result;
  result.extruding = meter.extruding();
  result.all = meter.all();
  result.end = meter.nozzle();
  result.base_end_mm = meter.base_mm();
  return result;
}

}  // namespace unflex::verify
