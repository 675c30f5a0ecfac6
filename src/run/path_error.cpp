#include "unflex/run/path_error.hpp"

#include <cmath>

#include "unflex/planner/plan_times.hpp"
#include "unflex/run/nozzle_motion.hpp"

namespace unflex::run {

void PathError::add(const PathError& other) {
  sum_mm2 += other.sum_mm2;
  samples += other.samples;
}

double PathError::rms_mm() const {
  return samples > 0 ? std::sqrt(sum_mm2 / static_cast<double>(samples)) : 0.0;
}

PathError path_error(const std::vector<planner::PlannedMove>& plan, double lead_in_s,
                     const dynamics::BaseTrajectory& base, const dynamics::NozzleXY& start,
                     const verify::NozzleModel& model) {
  PathError error;
  dynamics::NozzleXY nozzle = start;
  const NozzleOnBase on_base(base, model);
  planner::PlanCursor sliced(plan);
  for (std::size_t k = 0; k + 1 < base.nodes() && !sliced.at_end(); ++k) {
    const double t = static_cast<double>(k + 1) * base.period_s - lead_in_s;
    on_base.advance(k, nozzle);
    sliced.to(t);
    if (t > 0.0 && !sliced.at_end() && sliced.move().segment.extruding()) {
      const double away_mm = across_mm(sliced.move().segment,
                                       dynamics::place_mm(nozzle) - xy_of(sliced.position_mm()));
      error.sum_mm2 += away_mm * away_mm;
      ++error.samples;
    }
  }
  return error;
}

}  // namespace unflex::run
