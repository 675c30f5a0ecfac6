#include "timetable.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/core/math.hpp"
#include "unflex/planner/plan_times.hpp"

namespace unflex::emit {
namespace {

using gcode::E;
using gcode::Z;
using planner::PlannedMove;

// A move boundary must be a vertex when a typical line (2 ms) laid across it would give either move
// more than this too much or too little.
constexpr double kFilamentStepMm = 1e-5;
constexpr double kTypicalLineS = 2e-3;

}  // namespace

Timetable::Timetable(const Run& run) : run_(&run) {
  starts_s_ = planner::starts_s(*run.moves, run.lead_in_s);
  const dynamics::BaseTrajectory& base = *run.base;
  const auto place_mm = [&](std::size_t k) {
    return map_axes([&](const auto& axis) { return axis.position_mm[k]; }, base);
  };
  travelled_mm_.push_back(0.0);
  for (std::size_t k = 1; k < base.nodes(); ++k) {
    travelled_mm_.push_back(travelled_mm_.back() + distance(place_mm(k - 1), place_mm(k)));
  }
}

std::size_t Timetable::move_at(double t) const { return planner::move_at(starts_s_, t); }

bool Timetable::tail_at(double t) const {
  constexpr double kRounding_s = 1e-9;
  return t > starts_s_.back() - kRounding_s;
}

double Timetable::height_mm(double t) const {
  const dynamics::BaseTrajectory& base = *run_->base;
  return plan_height_mm(t) + (base.above ? base.at(*base.above, t).position_mm : 0.0);
}

double Timetable::plan_height_mm(double t) const {
  if (t >= starts_s_.back()) {
    return run_->moves->back().segment.end_mm[Z];
  }
  if (t <= starts_s_.front()) {
    return run_->moves->front().segment.start_mm[Z];
  }
  const std::size_t i = move_at(t);
  const PlannedMove& move = (*run_->moves)[i];
  const double from = travelled_mm(starts_s_[i]);
  const double length = travelled_mm(starts_s_[i + 1]) - from;
  const double share =
      length > 0.0 ? (travelled_mm(t) - from) / length : (t - starts_s_[i]) / move.duration_s();
  return move.segment.start_mm[Z] + share * move.segment.delta(Z);
}

double Timetable::filament_per_mm(std::size_t i) const {
  const double length = travelled_mm(starts_s_[i + 1]) - travelled_mm(starts_s_[i]);
  return length > 0.0 ? (*run_->moves)[i].segment.delta(E) / length : 0.0;
}

bool Timetable::filament_changes(std::size_t i) const {
  const auto pulls_back = [&](std::size_t move) {
    return (*run_->moves)[move].segment.delta(E) < 0.0;
  };
  if (pulls_back(i - 1) && pulls_back(i)) {
    return false;  // nothing is drawn, so it does not matter where along a wipe it happens
  }
  const double t = starts_s_[i];
  const double speed = length(run_->base->velocity_mm_s(t));
  const double jump = std::abs(filament_per_mm(i) - filament_per_mm(i - 1));
  return jump * std::max(speed, 1.0) * kTypicalLineS / 4.0 > kFilamentStepMm;
}

std::vector<double> Timetable::event_times_s() const {
  std::vector<double> times;
  std::size_t move = 0;
  for (const std::size_t count : *run_->move_counts) {
    times.push_back(starts_s_[move]);
    move += count;
  }
  return times;
}

double Timetable::travelled_mm(double t) const {
  const double at =
      std::clamp(t / run_->base->period_s, 0.0, static_cast<double>(travelled_mm_.size() - 1));
  const auto k = std::min(static_cast<std::size_t>(at), travelled_mm_.size() - 2);
  return travelled_mm_[k] +
         (at - static_cast<double>(k)) * (travelled_mm_[k + 1] - travelled_mm_[k]);
}

}  // namespace unflex::emit
