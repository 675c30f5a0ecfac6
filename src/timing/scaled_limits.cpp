// Notation as in local_scaling.cpp.
#include "scaled_limits.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bounded_plan.hpp"
#include "corner_speed.hpp"
#include "tunings.hpp"
#include "unflex/core/math.hpp"

namespace unflex::timing {
namespace {

using Tuned = ScalingTunings;

// g^{−exponent}, within the factors by which a limit may change in a round.
double scale(double g, double exponent) {
  return std::clamp(math::pow(std::max(g, Tuned::kLeastError), -exponent), Tuned::kLeastFactor,
                    Tuned::kMostFactor);
}

}  // namespace

void bind_as_sliced(const planner::PlannedMove& move, MoveBounds& bounds) {
  bounds.speed_mm_s = move.cruise_v_mm_s;
  bounds.accel_mm_s2 = move.accel_mm_s2;
  bounds.start_speed_mm_s = move.start_v_mm_s;
  bounds.end_speed_mm_s = move.end_v_mm_s;
}

ScaledLimits::ScaledLimits(const compensate::Course& course, const compensate::Setup& setup,
                           std::span<const MoveBounds> bounds, std::span<const double> ends_rad)
    : omega_rad_s_(least_of_axes(
          [](const compensate::AxisSetup& axis) { return axis.axis.slowest_rad_s(); }, setup)),
      allowed_(bounds.begin(), bounds.end()) {
  std::vector<double> ends_s;
  for (const double end_rad : ends_rad) {
    ends_s.push_back(end_rad / omega_rad_s_);
  }
  keep_seams(course);
  pieces_ = in_pieces(course.moves, allowed_, ends_s);
  const std::vector<bool> kept_moves = std::exchange(is_kept_, {});
  for (std::size_t i = 0; i < kept_moves.size(); ++i) {
    is_kept_.insert(is_kept_.end(), pieces_.counts[i], kept_moves[i]);
  }
  limit_accel(setup);
  bounds_ = pieces_.bounds;
  limit_vertices(course, setup);
}

std::vector<planner::PlannedMove> ScaledLimits::plan() const {
  return bounded_plan(pieces_.moves, bounds_, vertex_mm_s_);
}

void ScaledLimits::keep_seams(const compensate::Course& course) {
  is_kept_.assign(course.moves.size(), false);
  double time_s = 0.0;
  for (std::size_t i = 0;
       !course.before.empty() && i < course.moves.size() && time_s < Tuned::kSeam_s; ++i) {
    is_kept_[i] = true;
    time_s += course.moves[i].duration_s();
  }
  time_s = 0.0;
  for (std::size_t i = course.moves.size();
       !course.after.empty() && i-- > 0 && time_s < Tuned::kSeam_s;) {
    is_kept_[i] = true;
    time_s += course.moves[i].duration_s();
  }
  for (std::size_t i = 0; i < course.moves.size(); ++i) {
    if (is_kept_[i]) {
      bind_as_sliced(course.moves[i], allowed_[i]);
    }
  }
}

void ScaledLimits::limit_accel(const compensate::Setup& setup) {
  const double limit = setup.x.limits.max_accel_mm_s2;
  for (std::size_t i = 0; i < pieces_.moves.size(); ++i) {
    const XY direction = xy_of(pieces_.moves[i].direction);
    double& accel = pieces_.bounds[i].accel_mm_s2;
    accel = std::min(accel, limit / asked_of_motors(direction, setup.shares_motors));
  }
}

void ScaledLimits::limit_vertices(const compensate::Course& course,
                                  const compensate::Setup& setup) {
  const std::vector<planner::PlannedMove>& moves = pieces_.moves;
  vertex_mm_s_.assign(moves.size() + 1, 0.0);
  if (!course.before.empty()) {
    vertex_mm_s_.front() = moves.front().start_v_mm_s;
  }
  if (!course.after.empty()) {
    vertex_mm_s_.back() = moves.back().end_v_mm_s;
  }
  for (std::size_t i = 1; i < moves.size(); ++i) {
    vertex_mm_s_[i] =
        std::min(pieces_.bounds[i - 1].end_speed_mm_s, pieces_.bounds[i].start_speed_mm_s);
    if (!is_given(i) && (!is_kept_[i - 1] || !is_kept_[i])) {
      const bool travels = !moves[i - 1].segment.extruding() && !moves[i].segment.extruding();
      const double tolerance_mm =
          travels ? kTravelTolerance_mm
                  : std::min(pieces_.bounds[i - 1].tolerance_mm, pieces_.bounds[i].tolerance_mm);
      const double speed_mm_s =
          corner_speed_mm_s(moves[i - 1], moves[i],
                            Tuned::kCornerShare * setup.x.limits.max_accel_mm_s2, tolerance_mm);
      vertex_mm_s_[i] = std::min(vertex_mm_s_[i], std::max(speed_mm_s, Tuned::kLeastSpeed_mm_s));
    }
  }
}

bool ScaledLimits::is_given(std::size_t vertex) const {
  return std::isfinite(pieces_.bounds[vertex - 1].end_speed_mm_s) &&
         std::isfinite(pieces_.bounds[vertex].start_speed_mm_s);
}

ScaledLimits::Near ScaledLimits::largest_near(const std::vector<double>& of_nodes,
                                              const PlanNodes& nodes, double reach_s) const {
  const std::size_t count = pieces_.moves.size();
  Near near{std::vector<double>(count, 0.0), std::vector<double>(count + 1, 0.0)};
  std::size_t first = 0;
  for (std::size_t k = 0; k < of_nodes.size(); ++k) {
    const double t = static_cast<double>(k) * nodes.period_s;
    while (first + 1 < count && nodes.starts_s[first + 1] < t - reach_s) {
      ++first;
    }
    for (std::size_t i = first; i < count && nodes.starts_s[i] <= t + reach_s; ++i) {
      near.piece[i] = std::max(near.piece[i], of_nodes[k]);
      if (nodes.starts_s[i] >= t - reach_s) {
        near.vertex[i] = std::max(near.vertex[i], of_nodes[k]);
      }
    }
  }
  return near;
}

void ScaledLimits::rescale(const std::vector<planner::PlannedMove>& plan,
                           const NozzleMeasure& measured, const PlanNodes& nodes, double swing,
                           int round, int repaired) {
  const bool repairs = repaired > 0;
  const double cooled = math::power(Tuned::kCooling, round);
  const Step step{repairs ? Tuned::kAlphaOfRepairs : Tuned::kAlpha * cooled,
                  repairs ? Tuned::kBetaOfRepairs : Tuned::kBeta * cooled,
                  repairs ? 1.0 : Tuned::kMostFactor, repairs, repaired > Tuned::kMendsByAccel};
  const double reach = Tuned::kErrorReach_rad * (1.0 + Tuned::kWider * std::max(repaired - 1, 0));
  const Near error = largest_near(measured.error, nodes, reach / omega_rad_s_);
  const Near speed = largest_near(measured.speed, nodes, Tuned::kSpeedReach_rad / omega_rad_s_);
  const Near width = largest_near(measured.width, nodes, Tuned::kWidthReach_s);
  const double left = std::min(swing, Tuned::kMostLeft);
  for (std::size_t i = 1; i < plan.size(); ++i) {
    if (!is_kept_[i - 1] && !is_kept_[i]) {
      rescale_vertex(i, plan[i].start_v_mm_s, error.vertex[i] / Tuned::kAim, step);
    }
  }
  for (std::size_t i = 0; i < plan.size(); ++i) {
    if (!is_kept_[i]) {
      const bool is_near_end =
          nodes.starts_s.back() - nodes.starts_s[i + 1] < Tuned::kEndReach_rad / omega_rad_s_;
      rescale_piece(i, plan[i],
                    {std::max(error.piece[i], is_near_end ? left : 0.0) / Tuned::kAim,
                     width.piece[i] / Tuned::kAim, speed.piece[i] / Tuned::kAimOfFeed},
                    step);
    }
  }
}

void ScaledLimits::rescale_vertex(std::size_t i, double speed_mm_s, double g, const Step& step) {
  const bool is_bound = speed_mm_s > Tuned::kBoundShare * vertex_mm_s_[i];
  if (g > 1.0 || is_bound) {
    vertex_mm_s_[i] = std::min(
        std::max(std::min(vertex_mm_s_[i], g > 1.0 ? speed_mm_s : planner::kNoLimit) *
                     std::min(scale(g, step.alpha), step.most),
                 Tuned::kLeastSpeed_mm_s),
        std::min(pieces_.bounds[i - 1].end_speed_mm_s, pieces_.bounds[i].start_speed_mm_s));
  }
}

void ScaledLimits::rescale_piece(std::size_t i, const planner::PlannedMove& piece,
                                 const Errors& errors, const Step& step) {
  MoveBounds& own = bounds_[i];
  const MoveBounds& allowed = pieces_.bounds[i];
  if (piece.accel_s + piece.decel_s > 0.0) {
    double factor = std::min(scale(errors.g, step.beta), step.most);
    if (errors.width > 1.0) {
      factor = std::min(factor, scale(errors.width, Tuned::kGamma));
    }
    own.accel_mm_s2 = std::min(allowed.accel_mm_s2, own.accel_mm_s2 * factor);
  }
  const double for_speed = step.slows_for_width ? std::max(errors.g, errors.width) : errors.g;
  if (step.repairs && for_speed > 1.0) {
    own.speed_mm_s =
        std::max(piece.cruise_v_mm_s * scale(for_speed, step.alpha), Tuned::kLeastSpeed_mm_s);
  }
  if (errors.ahead > 1.0) {
    own.speed_mm_s =
        std::max(piece.cruise_v_mm_s * std::max(1.0 / errors.ahead, Tuned::kLeastSpeedFactor),
                 Tuned::kLeastSpeed_mm_s);
  } else if (!step.repairs && piece.cruise_v_mm_s > Tuned::kBoundSpeedShare * own.speed_mm_s) {
    own.speed_mm_s = std::min(
        allowed.speed_mm_s, own.speed_mm_s * std::min(1.0 / errors.ahead, Tuned::kMostSpeedFactor));
  }
}

void ScaledLimits::slow_down() {
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    if (!is_kept_[i]) {
      bounds_[i].accel_mm_s2 *= Tuned::kSlower;
      vertex_mm_s_[i] *= Tuned::kSlower;
    }
  }
}

}  // namespace unflex::timing
