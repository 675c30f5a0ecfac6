// Notation is that of vertex_regulator.hpp.
#include "vertices.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "vertex_regulator.hpp"

namespace unflex::emit {
namespace {

using namespace regulator;

// `reach`, widened to where the base itself goes.
Reach with_base(Reach reach, const BaseTrajectory& base, std::size_t axis) {
  for (std::size_t k = 0; k < base.nodes(); ++k) {
    const double at = base.at(base[axis], static_cast<double>(k) * base.period_s).position_mm;
    reach.min_mm = std::min(reach.min_mm, at);
    reach.max_mm = std::max(reach.max_mm, at);
  }
  return reach;
}

// The speed of the base at time t, or 0 where it rests.
double speed_at(const BaseTrajectory& base, std::size_t axis, double t, bool rests) {
  return rests ? 0.0 : base.at(base[axis], t).velocity_mm_s;
}

// Sets the bounds of each u and of the last g.
template <int kModes>
void set_bounds(const SpeedSteps& most, double before_mm_s, double after_mm_s, const Ends& ends,
                std::vector<Stage<kModes>>& stages, Ending<kModes>& ending) {
  // The bounds at the begin of line k, or at the end of the last line. The largest change of speed
  // is at least the base's own. If another part continues there, each side gets half.
  const auto bounds = [&](std::size_t k, double middles_s, bool shared, double own) {
    const double both = most.at_mm_s.empty()
                            ? std::min(most.step_mm_s, most.accel_mm_s2 * middles_s)
                            : most.at_mm_s[k];
    const double step = std::max(shared ? 0.5 * both : both, std::abs(own));
    return Bounds{-step - own, step - own};
  };
  for (std::size_t k = 0; k < stages.size(); ++k) {
    Stage<kModes>& line = stages[k];
    const double own = line.chord_mm_s - (k > 0 ? stages[k - 1].chord_mm_s : before_mm_s);
    const double middles_s =
        k > 0 ? 0.5 * (stages[k - 1].duration_s + line.duration_s) : 0.5 * line.duration_s;
    line.bounds = bounds(k, middles_s, k == 0 && !ends.from_rest, own);
  }
  // g = v − c, and v may differ from the speed behind it by one step.
  const Stage<kModes>& last = stages.back();
  ending.bounds =
      bounds(stages.size(), 0.5 * last.duration_s, !ends.to_rest, last.chord_mm_s - after_mm_s);
}

// The lines of a run as stages.
template <int kModes>
struct RunStages {
  // By length of a step, and by that and their number; most lines are of a few lengths.
  std::map<std::int64_t, Steps<kModes>> steps;
  std::map<std::pair<std::int64_t, int>, Shape<kModes>> shapes;
  std::vector<Stage<kModes>> stages;

  void add(const BaseTrajectory& base, std::size_t axis, const FlexibleAxis& nozzle,
           const Followed& followed, double begin_s, double end_s) {
    const double duration = end_s - begin_s;
    const int count = static_cast<int>(std::ceil(duration / base.period_s - 1e-9));
    const double dt = duration / count;
    constexpr double kSame_s = 1e-12;
    const std::int64_t length = std::llround(dt / kSame_s);
    const Steps<kModes>& step = steps.try_emplace(length, nozzle, dt).first->second;
    auto shape = shapes.find({length, count});
    if (shape == shapes.end()) {
      shape = shapes.emplace(std::pair{length, count}, shape_of(step, count)).first;
    }
    stages.push_back(stage(base, axis, followed, step, shape->second, begin_s, end_s));
  }
};

template <int kModes>
AxisVertices choose_vertices(const BaseTrajectory& base, std::size_t axis,
                             const FlexibleAxis& nozzle, const Followed& followed,
                             const std::vector<double>& times, const AxisGrid& grid,
                             const Reach& reach, const SpeedSteps& most, Ends ends) {
  constexpr int kZ = kOfZ<kModes>;
  const std::size_t lines = times.size() - 1;
  RunStages<kModes> run;
  std::vector<Stage<kModes>>& stages = run.stages;
  stages.reserve(lines);
  std::vector<double> on_curve = {base.at(base[axis], 0.0).position_mm};
  for (std::size_t k = 0; k < lines; ++k) {
    run.add(base, axis, nozzle, followed, times[k], times[k + 1]);
    on_curve.push_back(base.at(base[axis], times[k + 1]).position_mm);
  }
  Ending<kModes> ending;
  set_bounds(most, speed_at(base, axis, times.front(), ends.from_rest),
             speed_at(base, axis, times.back(), ends.to_rest), ends, stages, ending);
  const Reach within = with_base(reach, base, axis);
  // After the run e rings down.
  ending.cost.template topLeftCorner<kZ - 2, kZ - 2>() = ring_down_square<kModes>(nozzle);
  ending.cost(kZ - 2, kZ - 2) = kAtEnd;
  Regulator<kModes>(ending, stages).regulate();
  // Chooses the vertices by the laws, or on the curve. The last line takes what is left. Returns
  // whether it and all other lines keep their bounds.
  const auto draw = [&](bool by_law, AxisVertices& result) {
    result = {{on_curve.front()}, {0.0}};
    Vector<kZ> z = Vector<kZ>::Zero();
    bool within_bounds = true;
    for (std::size_t k = 0; k < lines; ++k) {
      const Stage<kModes>& line = stages[k];
      double vertex = on_curve[k + 1];
      if (k + 1 < lines) {
        if (by_law) {
          // We do not clamp each change to its bounds. The regulator would not know of that, and
          // what it misses on one line would grow on the next ones.
          const double change = line.feedback * z + line.feed_forward;
          vertex += z[kZ - 2] + line.duration_s * (z[kZ - 1] + change);
        }
        vertex = grid.nearest(std::clamp(vertex, within.min_mm, within.max_mm));
      }
      const double u = (vertex - on_curve[k + 1] - z[kZ - 2]) / line.duration_s - z[kZ - 1];
      z = line.behind(z, u);
      const double rounding = grid.step_mm / line.duration_s;
      within_bounds = within_bounds && line.bounds.hold(u, rounding) &&
                      (k + 1 < lines || ending.bounds.hold(z[kZ - 1], rounding));
      result.position_mm.push_back(vertex);
      result.nozzle_error_mm.push_back(position_of(z.template head<kZ - 2>()));
    }
    return within_bounds;
  };
  AxisVertices result;
  if (!draw(true, result)) {
    draw(false, result);
  }
  return result;
}

}  // namespace

double AxisGrid::nearest(double position_mm) const {
  return offset_mm + std::round((position_mm - offset_mm) / step_mm) * step_mm;
}

VertexChooser::VertexChooser(const BaseTrajectory& base, std::size_t axis,
                             const FlexibleAxis& nozzle)
    : base_(&base), axis_(axis), nozzle_(nozzle), followed_(base, axis, nozzle) {}

AxisVertices VertexChooser::choose(const std::vector<double>& times, const AxisGrid& grid,
                                   const Reach& reach, const SpeedSteps& most, Ends ends) const {
  const auto choose = [&](auto modes) {
    return choose_vertices<decltype(modes)::value>(*base_, axis_, nozzle_, followed_, times, grid,
                                                   reach, most, ends);
  };
  return with_modes(nozzle_.mode_count(), choose);
}

}  // namespace unflex::emit
