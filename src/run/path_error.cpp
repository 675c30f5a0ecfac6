#include "unflex/run/path_error.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/planner/plan_times.hpp"
#include "unflex/run/nozzle_motion.hpp"

namespace unflex::run {
namespace {

// target(t, sliced): where the nozzle should be t after the base has begun; nullopt where that
// ends.
template <typename Target>
void add_error(const RunOnBase& run, const verify::NozzleModel& model,
               const dynamics::FieldXY& field, const Target& target, PathError& error) {
  dynamics::NozzleXY nozzle = run.start;
  NozzleOnBase on_base(run.base, model, field);
  planner::PlanCursor sliced(run.plan);
  for (std::size_t k = 0; k + 1 < run.base.nodes(); ++k) {
    const double t = static_cast<double>(k + 1) * run.base.period_s;
    on_base.advance(k, nozzle);
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
      error.add(across_mm(segment, dynamics::place_mm(nozzle) - *wanted_mm));
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
    return emitted.at_end() ? std::nullopt : std::optional(dynamics::place_mm(real));
  };
  add_error(run, model, {}, replay, error);
}

}  // namespace unflex::run
