#include "unflex/run/emission_cost.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "unflex/planner/plan_times.hpp"
#include "unflex/run/nozzle_motion.hpp"

namespace unflex::run {

void EmissionCost::add(const std::vector<planner::PlannedMove>& original, double lead_in_s,
                       const dynamics::BaseTrajectory& base,
                       const std::vector<planner::PlannedMove>& replayed, double late_s,
                       const dynamics::NozzleXY& start, const verify::NozzleModel& model) {
  const double h = base.period_s;
  dynamics::NozzleXY optimal = start;
  dynamics::NozzleXY real = start;
  const NozzleOnBase on_base(base, model);
  planner::PlanCursor sliced(original);
  planner::PlanCursor emitted(replayed);
  for (std::size_t k = 0; k + 1 < base.nodes(); ++k) {
    const double t = static_cast<double>(k + 1) * h;
    on_base.advance(k, optimal);
    emitted.to(t + late_s, [&](const planner::PlannedMove& move, double from_s, double to_s) {
      advance(move, from_s, to_s, model, real);
    });
    sliced.to(t - lead_in_s);
    if (sliced.at_end() || emitted.at_end()) {
      return;
    }
    const gcode::Segment& segment = sliced.move().segment;
    if (t > lead_in_s && segment.extruding()) {
      const double away_mm =
          across_mm(segment, dynamics::place_mm(real) - dynamics::place_mm(optimal));
      sum_mm2_ += away_mm * away_mm;
      max_mm_ = std::max(max_mm_, away_mm);
      ++samples_;
    }
  }
}

double EmissionCost::rms_mm() const {
  return samples_ > 0 ? std::sqrt(sum_mm2_ / static_cast<double>(samples_)) : 0.0;
}

}  // namespace unflex::run
