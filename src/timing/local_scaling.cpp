// Notation:
//   u   largest speed at a vertex      V, a   largest speed and acceleration on a piece
//   g   error relative to the tolerance, the largest near a place
//   w   error of the line's width relative to its tolerance, the largest near a place
//   A   limit of the base's acceleration, per axis or per motor
//
//   u ← u g^{−α}     a ← a g^{−β}     V ← V F/v where the nozzle runs ahead of F
//   a ← a w^{−γ} where w > 1
//
// The extruder follows where speeds change slowly enough, so w makes accelerations smaller. A
// nozzle that becomes slower at a vertex would not help it.
//
// In a run that keeps its timing, V alone changes, and only where the nozzle runs ahead of F.
//
// The exponents become smaller from round to round. Once the plan's time hardly changes, limits are
// lowered only, until the nozzle keeps the tolerance everywhere. These last rounds are the repairs.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "model_shares.hpp"
#include "nozzle_measure.hpp"
#include "pieces.hpp"
#include "scaled_limits.hpp"
#include "tunings.hpp"
#include "unflex/planner/plan_times.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {
namespace {

using Tuned = ScalingTunings;

enum class Goal {
  least_time,  // any timing that keeps the tolerance and F
  feed,        // as sliced, but for F
};

class LocalScaling {
 public:
  LocalScaling(Goal goal, const compensate::Course& course, const compensate::Setup& setup,
               const dynamics::NozzleXY& nozzle, std::span<const MoveBounds> bounds,
               const compensate::Engine& engine, const std::optional<Extruder>& extruder,
               std::span<const double> ends_rad)
      : goal_(goal),
        course_(course),
        setup_(setup),
        nozzle_(nozzle),
        engine_(engine),
        extruder_(extruder),
        models_(models_of(setup)),
        limits_(course, setup, bounds, ends_rad) {
    if (goal_ == Goal::least_time && models_.size() > 1) {
      allow_as_sliced();
    }
  }

  // Whether the nozzle keeps F in the timing as sliced.
  [[nodiscard]] bool keeps_feed_as_sliced(std::span<const MoveBounds> bounds) {
    const std::optional<NozzleMeasure> sliced = try_plan(course_.moves, bounds);
    return !sliced || std::ranges::max(sliced->speed) <= kKeptFeed;
  }

  std::optional<Timed> find() {
    std::optional<Timed> best;
    // Where F is slow, the nozzle may run ahead of it in the timing as sliced. So a timing that is
    // hardly slower is better.
    double least_s = goal_ == Goal::feed
                         ? std::numeric_limits<double>::infinity()
                         : Tuned::kHardlySlower * planner::duration_s(course_.moves);
    const std::span<const planner::PlannedMove> sliced = course_.moves;
    course_.moves = limits_.pieces().moves;
    bool repairs = goal_ == Goal::feed;
    int repaired = 0;
    double last_s = 0.0;
    for (int round = 0; repaired < Tuned::kRepairs; ++round) {
      const std::vector<planner::PlannedMove> plan = limits_.plan();
      const double plan_s = planner::duration_s(plan);
      repairs = repairs || round + 1 >= Tuned::kRounds ||
                (round >= Tuned::kLeastRounds && std::abs(plan_s - last_s) < Tuned::kGain * plan_s);
      repaired += repairs ? 1 : 0;
      last_s = plan_s;
      if (repairs && plan_s >= least_s) {
        if (best || lays_evenly(sliced)) {
          break;  // it becomes only slower
        }
        least_s = std::numeric_limits<double>::infinity();
      }
      std::optional<NozzleMeasure> measured = try_plan(plan, limits_.pieces().bounds);
      if (measured) {
        forget_seams(measured->width);
      }
      if (measured && keeps(*measured, repaired)) {
        const double gain_s = least_s - plan_s;
        if (gain_s > 0.0) {
          least_s -= gain_s;
          best = Timed{plan, limits_.pieces().counts, {}, plants()};
        }
        if (repairs || (best && gain_s < Tuned::kGain * least_s)) {
          break;
        }
      }
      if (measured) {
        limits_.rescale(plan, *measured, nodes_, left_of(*measured), round, repaired);
        if (!repairs && course_.before.empty() && course_.after.empty()) {
          shares_.follow(*measured, limits_.pieces().moves, allowances_, setup_);
        }
      } else {
        limits_.slow_down();
      }
    }
    if (best) {
      join_even(best->moves, best->pieces);
    }
    return best;
  }

 private:
  [[nodiscard]] Plants plants() const {
    return map_axes([](const compensate::AxisSetup& axis) { return axis.plants; }, setup_);
  }

  // Pieces that keep their timing cannot give way to the extruder.
  void forget_seams(std::vector<double>& width) const {
    for (std::size_t i = 0; i < limits_.is_kept().size(); ++i) {
      if (limits_.is_kept()[i]) {
        const auto node = [&](double t) {
          return std::min(static_cast<std::size_t>(std::max(t, 0.0) / nodes_.period_s),
                          width.size());
        };
        std::fill(width.begin() + static_cast<std::ptrdiff_t>(node(nodes_.starts_s[i])),
                  width.begin() + static_cast<std::ptrdiff_t>(node(nodes_.starts_s[i + 1])), 0.0);
      }
    }
  }

  // Whether the extruder can lay evenly in the timing as sliced.
  [[nodiscard]] bool lays_evenly(std::span<const planner::PlannedMove> sliced) {
    if (!extruder_) {
      return true;
    }
    const std::optional<NozzleMeasure> measured = try_plan(sliced, limits_.allowed());
    return !measured || std::ranges::max(measured->width) <= kKept;
  }

  // Each repair moves all nodes behind it along the path, which may break a bound by a hair. So a
  // little more counts as kept with each repair.
  [[nodiscard]] bool keeps(const NozzleMeasure& measured, int repaired) const {
    return std::ranges::max(measured.error) <= kKept + Tuned::kMoreError * repaired &&
           std::ranges::max(measured.speed) <= kKeptFeed + Tuned::kMoreSpeed * repaired &&
           std::ranges::max(measured.width) <= kKept + Tuned::kMoreError * repaired &&
           left_of(measured) <= kKept;
  }

  // Finds the base for the plan and measures the nozzle. nullopt: the engine found none.
  [[nodiscard]] std::optional<NozzleMeasure> try_plan(std::span<const planner::PlannedMove> plan,
                                                      std::span<const MoveBounds> bounds) {
    compensate::Course course = course_;
    course.moves = plan;
    const compensate::NodeGrid grid = compensate::node_grid(course, setup_);
    const std::vector<compensate::WindowSpan> spans = compensate::mesh(course, grid, setup_);
    std::vector<compensate::RunWindow> windows =
        compensate::windows(course, spans, nozzle_, setup_);
    const Result<dynamics::BaseTrajectory> base = compensate::solve_all(engine_, spans, windows);
    if (!base) {
      return std::nullopt;
    }
    nodes_.period_s = grid.period_s;
    nodes_.starts_s = planner::starts_s(plan, compensate::origin_s(course, grid, setup_));
    NozzleMeasure measured = measure(plan, bounds, nodes_.starts_s, *base, models_, allowances_,
                                     course.before.empty() ? &nozzle_ : nullptr, extruder_);
    if (!course.after.empty() || goal_ == Goal::feed) {
      measured.left.assign(models_.size(), 0.0);
    }
    if (goal_ == Goal::feed) {
      std::ranges::fill(measured.error, 0.0);
    }
    return measured;
  }

  // The nozzle of one of several models may stray more than its tolerance even in the timing as
  // sliced. There it may stray as far as it does as sliced.
  void allow_as_sliced() {
    const std::optional<NozzleMeasure> sliced = try_plan(course_.moves, limits_.allowed());
    if (!sliced) {
      return;
    }
    allowances_.resize(models_.size());
    for (std::size_t m = 0; m < models_.size(); ++m) {
      for (std::size_t i = 0; i < limits_.pieces().counts.size(); ++i) {
        allowances_[m].insert(allowances_[m].end(), limits_.pieces().counts[i],
                              std::max(Tuned::kSampling * sliced->of_pieces[m][i], 1.0));
      }
      left_allowed_.push_back(std::max(Tuned::kSampling * sliced->left[m], 1.0));
    }
  }

  // The largest swing in the end, relative to its allowance.
  [[nodiscard]] double left_of(const NozzleMeasure& measured) const {
    double left = 0.0;
    for (std::size_t m = 0; m < measured.left.size(); ++m) {
      left = std::max(left, measured.left[m] / (left_allowed_.empty() ? 1.0 : left_allowed_[m]));
    }
    return left;
  }

  Goal goal_;
  compensate::Course course_;
  compensate::Setup setup_;
  const dynamics::NozzleXY& nozzle_;
  const compensate::Engine& engine_;
  std::optional<Extruder> extruder_;
  std::vector<AxesModel> models_;
  ModelShares shares_{setup_};
  ScaledLimits limits_;
  Allowances allowances_;
  std::vector<double> left_allowed_;  // for each model; empty: 1
  PlanNodes nodes_;                   // of the last plan
};

// Whether lines go evenly below their speed, and the time that this costs matters.
bool is_slow_on_long_lines(const Timed& timed, std::span<const MoveBounds> bounds) {
  double lost_s = 0.0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < timed.pieces.size(); ++i) {
    for (const std::size_t end = next + timed.pieces[i]; next < end; ++next) {
      const planner::PlannedMove& piece = timed.moves[next];
      lost_s += piece.cruise_s * std::max(0.0, 1.0 - piece.cruise_v_mm_s / bounds[i].speed_mm_s);
    }
  }
  return lost_s > Tuned::kLossThatMatters * planner::duration_s(timed.moves);
}

}  // namespace

std::optional<Timed> faster(const compensate::Course& course, const compensate::Setup& setup,
                            const dynamics::NozzleXY& nozzle, std::span<const MoveBounds> bounds,
                            const compensate::Engine& engine,
                            const std::optional<Extruder>& extruder) {
  const auto find = [&](std::span<const double> ends) {
    return LocalScaling(Goal::least_time, course, setup, nozzle, bounds, engine, extruder, ends)
        .find();
  };
  std::optional<Timed> found = find(Tuned::kPieces_rad);
  if (found && is_slow_on_long_lines(*found, bounds)) {
    std::optional<Timed> other = find(Tuned::kMorePieces_rad);
    if (other && planner::duration_s(other->moves) < planner::duration_s(found->moves)) {
      found = std::move(other);
    }
  }
  return found;
}

std::optional<Timed> within_feed(const compensate::Course& course, const compensate::Setup& setup,
                                 const dynamics::NozzleXY& nozzle,
                                 std::span<const MoveBounds> bounds,
                                 const compensate::Engine& engine) {
  std::vector<MoveBounds> as_sliced(bounds.begin(), bounds.end());
  for (std::size_t i = 0; i < as_sliced.size(); ++i) {
    bind_as_sliced(course.moves[i], as_sliced[i]);
  }
  LocalScaling scaling(Goal::feed, course, setup, nozzle, as_sliced, engine, {},
                       Tuned::kFeedPieces_rad);
  return scaling.keeps_feed_as_sliced(as_sliced) ? std::nullopt : scaling.find();
}

}  // namespace unflex::timing
