#include "nozzle_progress.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "unflex/core/foot.hpp"
#include "unflex/dynamics/node_map.hpp"
#include "unflex/planner/plan_times.hpp"

namespace unflex::emit {
namespace {

using gcode::E;
using planner::PlannedMove;

// The nozzle is looked for this far along the path on both sides of the reference.
constexpr double kWindow_mm = 1.0;
// λ: where the path comes back to itself, the place that is nearer to the reference counts. This
// share of the nozzle's lag is not seen.
constexpr double kTowardsReference = 0.01;

}  // namespace

NozzleProgress::NozzleProgress(const Run& run, const std::vector<double>& starts_s,
                               const Axes<dynamics::FlexibleAxis>& nozzle,
                               const dynamics::FieldXY& field)
    : moves_(run.moves), period_s_(run.base->period_s) {
  path_mm_.push_back(0.0);
  filament_mm_.push_back(0.0);
  laid_mm_.push_back(0.0);
  for (const PlannedMove& move : *moves_) {
    path_mm_.push_back(path_mm_.back() + move.segment.length_xy_mm());
    filament_mm_.push_back(filament_mm_.back() + move.segment.delta(E));
    laid_mm_.push_back(laid_mm_.back() + std::max(move.segment.delta(E), 0.0));
  }
  std::size_t i = 0;
  const auto reference_mm = [&](double t) {
    i = planner::move_at(starts_s, t, i);
    const PlannedMove& move = (*moves_)[i];
    const double length = path_mm_[i + 1] - path_mm_[i];
    if (t >= starts_s[i + 1] || move.length_mm <= 0.0) {
      return t >= starts_s[i] ? path_mm_[i + 1] : path_mm_[i];
    }
    return path_mm_[i] + length * move.distance_mm(std::max(t - starts_s[i], 0.0)) / move.length_mm;
  };
  const auto flow_mm_s = [&](double t) {
    if (t >= starts_s.back()) {
      return 0.0;
    }
    const std::size_t number = planner::move_at(starts_s, t);
    const PlannedMove& move = (*moves_)[number];
    return std::max(move.direction[E], 0.0) * move.velocity_mm_s(t - starts_s[number]);
  };
  flow_begin_mm_s_ = run.goes_on ? flow_mm_s(0.0) : 0.0;
  flow_end_mm_s_ = run.until_s ? flow_mm_s(*run.until_s) : 0.0;
  // A run begins at rest. A part of a run begins in motion, and we take the nozzle to be on the
  // reference then.
  dynamics::NozzleXY state =
      riding(nozzle, run.base->position_mm(0.0), run.base->velocity_mm_s(0.0));
  if (run.goes_on) {
    const std::size_t first = planner::move_at(starts_s, 0.0);
    const PlannedMove& move = (*moves_)[first];
    const double local_s = std::clamp(-starts_s[first], 0.0, move.duration_s());
    state = riding(nozzle, xy_of(move.position_mm(local_s)),
                   move.velocity_mm_s(local_s) * xy_of(move.direction));
  }
  using Maps = dynamics::FieldMaps<dynamics::NodeMap>;
  Axes<Maps> maps = map_axes(
      [&](const dynamics::FlexibleAxis& axis, const dynamics::FrequencyField& of_axis) {
        return Maps(axis, of_axis, period_s_);
      },
      nozzle, field);
  double furthest = 0.0;
  for (std::size_t k = 0; k < run.base->nodes(); ++k) {
    if (k > 0) {
      const XY from_mm = run.base->node_mm(k - 1);
      for_each_axis(
          [&](Maps& of_axis, const dynamics::AxisTrajectory& base,
              dynamics::NozzleState& of_nozzle) {
            of_axis.at(from_mm).advance(base, k - 1, of_nozzle);
          },
          maps, *run.base, state);
    }
    const double t = period_s_ * static_cast<double>(k);
    if (t < starts_s.front()) {
      // In the lead-in the nozzle may swing along the path, but the path has not begun.
      progress_mm_.push_back(furthest);
      continue;
    }
    const double at_mm = reference_mm(t);
    furthest = std::max(furthest, nearest_mm(dynamics::place_mm(state), i, at_mm));
    progress_mm_.push_back(furthest);
  }
}

double NozzleProgress::nearest_mm(const XY& p_mm, std::size_t move, double reference_mm) const {
  double best = std::numeric_limits<double>::infinity();
  double nearest = reference_mm;
  const auto look_at = [&](std::size_t i) {
    const gcode::Segment& segment = (*moves_)[i].segment;
    const double length = path_mm_[i + 1] - path_mm_[i];
    if (length <= 0.0) {
      return;
    }
    const XY direction = segment.way_xy_mm() / length;
    const XY from_start_mm = p_mm - xy_of(segment.start_mm);
    const double ahead = reference_mm - path_mm_[i];
    const double along = std::clamp(
        (dot(from_start_mm, direction) + kTowardsReference * ahead) / (1.0 + kTowardsReference),
        0.0, length);
    const double cost = foot_at(from_start_mm, direction, along).distance2_mm2 +
                        kTowardsReference * (along - ahead) * (along - ahead);
    if (cost < best) {
      best = cost;
      nearest = path_mm_[i] + along;
    }
  };
  // Further away than this, λ (u − s)² alone is more than the least cost so far.
  const auto reach_mm = [&] { return std::min(kWindow_mm, std::sqrt(best / kTowardsReference)); };
  look_at(move);
  for (std::size_t i = move; i > 0 && reference_mm - path_mm_[i] <= reach_mm();) {
    look_at(--i);
  }
  for (std::size_t i = move + 1; i < moves_->size() && path_mm_[i] - reference_mm <= reach_mm();
       ++i) {
    look_at(i);
  }
  return nearest;
}

double NozzleProgress::progress_mm(double t) const {
  const double at = std::clamp(t / period_s_, 0.0, static_cast<double>(progress_mm_.size() - 1));
  const std::size_t k = std::min(static_cast<std::size_t>(at), progress_mm_.size() - 2);
  return progress_mm_[k] + (at - static_cast<double>(k)) * (progress_mm_[k + 1] - progress_mm_[k]);
}

double NozzleProgress::begin_s(std::size_t i) const {
  const auto after = std::lower_bound(progress_mm_.begin(), progress_mm_.end(), path_mm_[i]);
  const auto k = static_cast<std::size_t>(after - progress_mm_.begin());
  if (k == 0 || after == progress_mm_.end()) {
    return period_s_ * static_cast<double>(std::min(k, progress_mm_.size() - 1));
  }
  const double share =
      (path_mm_[i] - progress_mm_[k - 1]) / (progress_mm_[k] - progress_mm_[k - 1]);
  return period_s_ * (static_cast<double>(k - 1) + share);
}

double NozzleProgress::filament_mm(double t) const { return along(filament_mm_, t); }

double NozzleProgress::laid_mm(double t) const { return along(laid_mm_, t); }

double NozzleProgress::drawn_back_mm(double t) const { return filament_mm(t) - laid_mm(t); }

double NozzleProgress::along(const std::vector<double>& at_moves, double t) const {
  const double at = progress_mm(t);
  const auto after = std::upper_bound(path_mm_.begin(), path_mm_.end() - 1, at);
  const std::size_t i =
      after == path_mm_.begin() ? 0 : static_cast<std::size_t>(after - path_mm_.begin()) - 1;
  const double length = path_mm_[i + 1] - path_mm_[i];
  const double share = length > 0.0 ? std::min((at - path_mm_[i]) / length, 1.0) : 1.0;
  return at_moves[i] + share * (at_moves[i + 1] - at_moves[i]);
}

bool NozzleProgress::past_first_move(double t) const { return progress_mm(t) >= path_mm_[1]; }

}  // namespace unflex::emit
