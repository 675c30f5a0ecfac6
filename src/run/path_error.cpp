#include "unflex/run/path_error.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/planner/plan_times.hpp"
#include "unflex/run/nozzle_motion.hpp"

namespace unflex::run {
namespace {

XY nozzle_place_mm(const planner::PlanCursor& base, const verify::NozzleModel& model,
                   const dynamics::NozzleXY& nozzle) {
  if (!model.frame) {
    return dynamics::place_mm(nozzle);
  }
  const auto ahead = model.frame->ahead(nozzle);
  return xy_of(base.position_mm()) + XY{ahead[0].position, ahead[1].position};
}

// target(t, sliced): where the nozzle should be t after the base has begun; nullopt where that
// ends.
template <typename Target>
void add_error(const RunOnBase& run, const verify::NozzleModel& model,
               const dynamics::FieldXY& field, const Target& target, PathError& error) {
  NozzleOnBase on_base(run.base, model, field, run.start);
  planner::PlanCursor sliced(run.plan);
  for (std::size_t k = 0; k + 1 < run.base.nodes(); ++k) {
    const double t = static_cast<double>(k + 1) * run.base.period_s;
    const XY nozzle_mm = on_base.advance(k);
    sliced.to(t - run.lead_in_s);
    if (sliced.at_end()) {
      return;
    }
    const std::optional<XY> wanted_mm = target(t, sliced);
    if (!wanted_mm) {
      return;
    }
    const gcode::Segment& segment = sliced.move().segment;
    if (t > run.lead_in_s && segment.extruding()) {
      error.add(across_mm(segment, nozzle_mm - *wanted_mm));
    }
  }
}

}  // namespace

void PathError::add(double away_mm) {
  sum_mm2 += away_mm * away_mm;
  max_mm = std::max(max_mm, away_mm);
  ++samples;
}

void PathError::add(const PathError& other) {
  sum_mm2 += other.sum_mm2;
  max_mm = std::max(max_mm, other.max_mm);
  samples += other.samples;
}

double PathError::rms_mm() const {
  return samples > 0 ? std::sqrt(sum_mm2 / static_cast<double>(samples)) : 0.0;
}

PathError path_error(const RunOnBase& run, const verify::NozzleModel& model,
                     const dynamics::FieldXY& field) {
  PathError error;
  add_error(
      run, model, field,
      [](double, const planner::PlanCursor& sliced) {
        return std::optional(xy_of(sliced.position_mm()));
      },
      error);
  return error;
}

void add_emission_error(const RunOnBase& run, const std::vector<planner::PlannedMove>& replayed,
                        double late_s, const verify::NozzleModel& model, PathError& error) {
  dynamics::NozzleXY real = run.start;
  planner::PlanCursor emitted(replayed);
  const auto replay = [&](double t, const planner::PlanCursor&) {
    emitted.to(t + late_s, [&](const planner::PlannedMove& move, double from_s, double to_s) {
      advance(move, from_s, to_s, model, real);
    });
    if (emitted.at_end()) {
      return std::optional<XY>();
    }
    return std::optional(nozzle_place_mm(emitted, model, real));
  };
  add_error(run, model, {}, replay, error);
}

}  // namespace unflex::run
