#include "unflex/verify/deviation.hpp"

#include <algorithm>
#include <cmath>

#include "log_histogram.hpp"
#include "meter.hpp"
#include "reference_path.hpp"

namespace unflex::verify {

void DeviationAccumulator::add(double contour_mm, double tracking_mm, double weight_s,
                               std::size_t line) {
  add_to_histogram(histogram_s_, contour_mm, weight_s);
  sum_contour2_ += weight_s * contour_mm * contour_mm;
  sum_tracking2_ += weight_s * tracking_mm * tracking_mm;
  weight_s_ += weight_s;
  tracking_max_ = std::max(tracking_max_, tracking_mm);
  if (contour_mm > contour_max_) {
    contour_max_ = contour_mm;
    line_ = line;
  }
}

void DeviationAccumulator::merge(const DeviationAccumulator& other) {
  if (histogram_s_.empty()) {
    histogram_s_ = other.histogram_s_;
  } else {
    // The other one may be empty: then it has no cells.
    std::transform(other.histogram_s_.begin(), other.histogram_s_.end(), histogram_s_.begin(),
                   histogram_s_.begin(), std::plus<>());
  }
  sum_contour2_ += other.sum_contour2_;
  sum_tracking2_ += other.sum_tracking2_;
  weight_s_ += other.weight_s_;
  tracking_max_ = std::max(tracking_max_, other.tracking_max_);
  if (other.contour_max_ > contour_max_) {
    contour_max_ = other.contour_max_;
    line_ = other.line_;
  }
}

DeviationStats DeviationAccumulator::stats() const {
  DeviationStats stats;
  if (weight_s_ <= 0.0) {
    return stats;
  }
  stats.contour_max_mm = contour_max_;
  stats.contour_p99_mm = std::min(contour_max_, histogram_quantile(histogram_s_, 0.99));
  stats.contour_rms_mm = std::sqrt(sum_contour2_ / weight_s_);
  stats.tracking_max_mm = tracking_max_;
  stats.tracking_rms_mm = std::sqrt(sum_tracking2_ / weight_s_);
  stats.duration_s = weight_s_;
  stats.contour_max_line = line_;
  return stats;
}

RunDeviation measure(const std::vector<planner::PlannedMove>& reference,
                     const std::vector<planner::PlannedMove>& base, NozzleXY start,
                     const NozzleModel& model, double lead_in_s) {
  std::size_t taken = 0;
  ReferencePath path([&](planner::PlannedMove& move) {
    if (taken == reference.size()) {
      return false;
    }
    move = reference[taken++];
    return true;
  });
  path.begin_section(lead_in_s);
  Meter meter(model);
  meter.begin_section(path);
  if (base.empty() && reference.empty()) {
    meter.set_state(start, start.x.position, start.y.position);
  } else {
    const planner::PlannedMove& first = base.empty() ? reference.front() : base.front();
    meter.set_state(start, first.segment.start_mm[gcode::X], first.segment.start_mm[gcode::Y]);
  }
  for (const planner::PlannedMove& move : base) {
    meter.play(move);
    path.discard_before(meter.time_s() - meter.reach_s());
  }
  meter.wait_for_reference();

  RunDeviation result;
  result.extruding = meter.extruding();
  result.all = meter.all();
  result.end = meter.nozzle();
  result.base_end_x_mm = meter.base_x_mm();
  result.base_end_y_mm = meter.base_y_mm();
  return result;
}

}  // namespace unflex::verify
