#include "emission_cost.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "nozzle_motion.hpp"

namespace unflex::pipeline {
namespace {

using dynamics::NozzleState;

// Over one node period. Acceleration is linear between nodes; for the nozzle each half's mean does
// as well.
NozzleState follow(const dynamics::AxisTrajectory& base, std::size_t k, double h,
                   const dynamics::FlexibleAxis& axis, NozzleState state) {
  const double change = base.accel_mm_s2[k + 1] - base.accel_mm_s2[k];
  const dynamics::AxisMotion middle = dynamics::between(base, k, 0.5 * h, h);
  state = dynamics::exact_step(
      axis, state,
      {base.position_mm[k], base.velocity_mm_s[k], base.accel_mm_s2[k] + 0.25 * change}, 0.5 * h);
  return dynamics::exact_step(
      axis, state, {middle.position_mm, middle.velocity_mm_s, base.accel_mm_s2[k] + 0.75 * change},
      0.5 * h);
}

// Walks along a plan.
class Walk {
 public:
  explicit Walk(const std::vector<planner::PlannedMove>& moves) : moves_(&moves) {}

  [[nodiscard]] bool at_end() const { return index_ == moves_->size(); }
  [[nodiscard]] const planner::PlannedMove& move() const { return (*moves_)[index_]; }

  // To `t`; visit(move, from, to) for each stretch on the way, in seconds since the move's start.
  template <typename Visit>
  void to(double t, const Visit& visit) {
    for (; !at_end() && start_s_ + move().duration_s() <= t; ++index_, done_s_ = 0.0) {
      visit(move(), done_s_, move().duration_s());
      start_s_ += move().duration_s();
    }
    if (!at_end() && t > start_s_ + done_s_) {
      visit(move(), done_s_, t - start_s_);
      done_s_ = t - start_s_;
    }
  }

 private:
  const std::vector<planner::PlannedMove>* moves_;
  std::size_t index_ = 0;
  double start_s_ = 0.0;  // of the move
  double done_s_ = 0.0;   // of it
};

}  // namespace

void EmissionCost::add(const std::vector<planner::PlannedMove>& original, double lead_in_s,
                       const dynamics::BaseTrajectory& base,
                       const std::vector<planner::PlannedMove>& replayed,
                       const dynamics::NozzleXY& start, const verify::NozzleModel& model) {
  const double h = base.period_s;
  dynamics::NozzleXY optimal = start;
  dynamics::NozzleXY real = start;
  Walk sliced(original);
  Walk emitted(replayed);
  for (std::size_t k = 0; k + 1 < base.nodes(); ++k) {
    const double t = static_cast<double>(k + 1) * h;
    optimal = {follow(base.x, k, h, model.x, optimal.x), follow(base.y, k, h, model.y, optimal.y)};
    emitted.to(t, [&](const planner::PlannedMove& move, double from_s, double to_s) {
      advance(move, from_s, to_s, model, real);
    });
    sliced.to(t - lead_in_s, [](const planner::PlannedMove&, double, double) {});
    if (sliced.at_end() || emitted.at_end()) {
      return;
    }
    const gcode::Segment& segment = sliced.move().segment;
    if (t > lead_in_s && segment.extruding()) {
      const double away_mm =
          std::abs(segment.delta(gcode::X) * (real.y.position - optimal.y.position) -
                   segment.delta(gcode::Y) * (real.x.position - optimal.x.position)) /
          segment.length_xy_mm();
      sum_mm2_ += away_mm * away_mm;
      max_mm_ = std::max(max_mm_, away_mm);
      ++samples_;
    }
  }
}

double EmissionCost::rms_mm() const {
  return samples_ > 0 ? std::sqrt(sum_mm2_ / static_cast<double>(samples_)) : 0.0;
}

}  // namespace unflex::pipeline
