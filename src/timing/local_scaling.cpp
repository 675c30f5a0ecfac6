// Notation:
//   u   largest speed at a vertex      V, a   largest speed and acceleration on a piece
//   g   error relative to the tolerance, the largest near a place
//   w   error of the line's width relative to its tolerance, likewise
//   A   limit of the base's acceleration, per axis or per motor
//
//   u ← u g^{−α}     a ← a g^{−β}     V ← V F/v where the nozzle runs ahead of F
//   a ← a w^{−γ} where w > 1
//
// The extruder follows where speeds change slowly enough, so w makes accelerations smaller. A
// nozzle that becomes slower at a vertex would not help it.
//
// In a run that keeps its timing V alone changes, where the nozzle runs ahead of F.
//
// The exponents become smaller from round to round. Once the plan's time hardly changes, limits are
// lowered only, until the nozzle keeps the tolerance everywhere.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "bounded_plan.hpp"
#include "corner_speed.hpp"
#include "model_shares.hpp"
#include "nozzle_measure.hpp"
#include "pieces.hpp"
#include "unflex/core/math.hpp"
#include "unflex/planner/plan_times.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {
namespace {

// Rounds in which limits may rise, at least and at most, and those in which they are lowered only.
constexpr int kLeastRounds = 3;
constexpr int kRounds = 10;
constexpr int kRepairs = 20;
constexpr double kMoreError = 0.002;
constexpr double kMoreSpeed = 0.00002;
constexpr double kAlpha = 0.45;
constexpr double kBeta = 0.2;
constexpr double kGamma = 0.5;
// After so many repairs by accelerations alone, the width makes speeds smaller as well.
constexpr int kMendsByAccel = 4;
constexpr double kCooling = 0.87;  // of both, from round to round
// The repairs are in more of a hurry, and reach further from round to round.
constexpr double kAlphaOfRepairs = 0.8;
constexpr double kBetaOfRepairs = 0.5;
constexpr double kWider = 0.25;
// What a limit may change by in a round.
constexpr double kLeastFactor = 0.6;
constexpr double kMostFactor = 1.3;
constexpr double kLeastSpeedFactor = 0.8;
constexpr double kMostSpeedFactor = 1.05;
constexpr double kLeastSpeed_mm_s = 1.0;
// The share of the tolerance that is aimed at.
constexpr double kAim = 0.97;
// The nozzle's speed relative to F that is aimed at.
constexpr double kAimOfFeed = 1.014;
// How far in time the width depends on accelerations, on either side.
constexpr double kWidthReach_s = 0.02;
// A larger swing in the end counts as this.
constexpr double kMostLeft = 4.0;
// How far in time an error depends on a limit, and how long the pieces at both ends of a move are,
// in 1/ω.
constexpr double kErrorReach = 2.3;
constexpr double kSpeedReach = 1.1;
constexpr double kEndReach = 3.4;
constexpr std::array kPieces = {1.1, 2.3};
// With a third piece a swing behind a corner does not slow down the rest of a long line. But speeds
// that change more often make swings of their own.
constexpr std::array kMorePieces = {1.1, 2.3, 5.0};
// What runs ahead of F does so for a moment, at vertices and behind them.
constexpr std::array kFeedPieces = {1.1, 2.3, 5.0, 10.0};
// A round that changes the run's time by less than this share is the last of its kind.
constexpr double kGain = 1e-3;

// g^{−exponent}, within what a limit may change by.
double scale(double g, double exponent) {
  constexpr double kLeastError = 1e-3;
  return std::clamp(math::pow(std::max(g, kLeastError), -exponent), kLeastFactor, kMostFactor);
}

// The move becomes no faster than it was sliced.
void bind_as_sliced(const planner::PlannedMove& move, MoveBounds& bounds) {
  bounds.speed_mm_s = move.cruise_v_mm_s;
  bounds.accel_mm_s2 = move.accel_mm_s2;
  bounds.start_speed_mm_s = move.start_v_mm_s;
  bounds.end_speed_mm_s = move.end_v_mm_s;
}

enum class Goal {
  least_time,  // whatever keeps the tolerance and F
  feed,        // as sliced, but for F
};

class LocalScaling {
 public:
  LocalScaling(Goal goal, const compensate::Course& course, const compensate::Setup& setup,
               const dynamics::NozzleXY& nozzle, std::span<const MoveBounds> bounds,
               const compensate::Engine& engine, const std::optional<Extruder>& extruder,
               std::span<const double> ends)
      : goal_(goal),
        course_(course),
        setup_(setup),
        nozzle_(nozzle),
        engine_(engine),
        extruder_(extruder),
        models_(models_of(setup)),
        omega_rad_s_(least_of_axes(
            [](const compensate::AxisSetup& axis) { return axis.axis.slowest_rad_s(); }, setup)) {
    std::vector<double> ends_s;
    for (const double end : ends) {
      ends_s.push_back(end / omega_rad_s_);
    }
    allowed_.assign(bounds.begin(), bounds.end());
    keep_seams(course.moves, allowed_);
    pieces_ = in_pieces(course.moves, allowed_, ends_s);
    const std::vector<bool> of_moves = std::exchange(is_kept_, {});
    for (std::size_t i = 0; i < of_moves.size(); ++i) {
      is_kept_.insert(is_kept_.end(), pieces_.counts[i], of_moves[i]);
    }
    limit_accel();
    bounds_ = pieces_.bounds;
    limit_vertices();
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
    // Where F is slow, the nozzle may run ahead of it in the timing as sliced. So one that is
    // hardly slower is better.
    constexpr double kHardlySlower = 1.01;
    double least_s = goal_ == Goal::feed ? std::numeric_limits<double>::infinity()
                                         : kHardlySlower * planner::duration_s(course_.moves);
    const std::span<const planner::PlannedMove> sliced = course_.moves;
    course_.moves = pieces_.moves;
    bool repairs = goal_ == Goal::feed;
    int repaired = 0;
    double last_s = 0.0;
    for (int round = 0; repaired < kRepairs; ++round) {
      const std::vector<planner::PlannedMove> plan =
          bounded_plan(pieces_.moves, bounds_, vertex_mm_s_);
      const double plan_s = planner::duration_s(plan);
      repairs = repairs || round + 1 >= kRounds ||
                (round >= kLeastRounds && std::abs(plan_s - last_s) < kGain * plan_s);
      repaired += repairs ? 1 : 0;
      last_s = plan_s;
      if (repairs && plan_s >= least_s) {
        if (best || lays_evenly(sliced)) {
          break;  // it becomes only slower
        }
        least_s = std::numeric_limits<double>::infinity();
      }
      std::optional<NozzleMeasure> measured = try_plan(plan, pieces_.bounds);
      if (measured) {
        forget_seams(measured->width);
      }
      if (measured && keeps(*measured, repaired)) {
        const double gain_s = least_s - plan_s;
        if (gain_s > 0.0) {
          least_s -= gain_s;
          best = Timed{plan, pieces_.counts, {}, plants()};
        }
        if (repairs || (best && gain_s < kGain * least_s)) {
          break;
        }
      }
      if (measured) {
        rescale(plan, *measured, round, repaired);
        if (!repairs && course_.before.empty() && course_.after.empty()) {
          shares_.follow(*measured, pieces_.moves, allowances_, setup_);
        }
      } else {
        slow_down();
      }
    }
    if (best) {
      join_even(best->moves, best->pieces);
    }
    return best;
  }

 private:
  // Where a part of a run meets its neighbours, which are solved by themselves, it keeps its
  // timing.
  void keep_seams(std::span<const planner::PlannedMove> path, std::vector<MoveBounds>& bounds) {
    constexpr double kSeam_s = 0.3;
    is_kept_.assign(path.size(), false);
    double time_s = 0.0;
    for (std::size_t i = 0; !course_.before.empty() && i < path.size() && time_s < kSeam_s; ++i) {
      is_kept_[i] = true;
      time_s += path[i].duration_s();
    }
    time_s = 0.0;
    for (std::size_t i = path.size(); !course_.after.empty() && i-- > 0 && time_s < kSeam_s;) {
      is_kept_[i] = true;
      time_s += path[i].duration_s();
    }
    for (std::size_t i = 0; i < path.size(); ++i) {
      if (is_kept_[i]) {
        bind_as_sliced(path[i], bounds[i]);
      }
    }
  }

  [[nodiscard]] Plants plants() const {
    return map_axes([](const compensate::AxisSetup& axis) { return axis.plants; }, setup_);
  }

  void limit_accel() {
    const double limit = setup_.x.limits.max_accel_mm_s2;
    for (std::size_t i = 0; i < pieces_.moves.size(); ++i) {
      const XY direction = xy_of(pieces_.moves[i].direction);
      double& accel = pieces_.bounds[i].accel_mm_s2;
      accel = std::min(accel, limit / asked_of_motors(direction, setup_.shares_motors));
    }
  }

  void limit_vertices() {
    const std::vector<planner::PlannedMove>& moves = pieces_.moves;
    vertex_mm_s_.assign(moves.size() + 1, 0.0);
    if (!course_.before.empty()) {
      vertex_mm_s_.front() = moves.front().start_v_mm_s;
    }
    if (!course_.after.empty()) {
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
        const double speed_mm_s = corner_speed_mm_s(
            moves[i - 1], moves[i], 0.5 * setup_.x.limits.max_accel_mm_s2, tolerance_mm);
        vertex_mm_s_[i] = std::min(vertex_mm_s_[i], std::max(speed_mm_s, kLeastSpeed_mm_s));
      }
    }
  }

  // Whether the moves on both sides of the vertex are to pass it as fast as sliced.
  [[nodiscard]] bool is_given(std::size_t vertex) const {
    return std::isfinite(pieces_.bounds[vertex - 1].end_speed_mm_s) &&
           std::isfinite(pieces_.bounds[vertex].start_speed_mm_s);
  }

  // Pieces that keep their timing cannot give way to the extruder.
  void forget_seams(std::vector<double>& width) const {
    for (std::size_t i = 0; i < is_kept_.size(); ++i) {
      if (is_kept_[i]) {
        const auto node = [&](double t) {
          return std::min(static_cast<std::size_t>(std::max(t, 0.0) / period_s_), width.size());
        };
        std::fill(width.begin() + static_cast<std::ptrdiff_t>(node(starts_s_[i])),
                  width.begin() + static_cast<std::ptrdiff_t>(node(starts_s_[i + 1])), 0.0);
      }
    }
  }

  // Whether the extruder can lay evenly in the timing as sliced.
  [[nodiscard]] bool lays_evenly(std::span<const planner::PlannedMove> sliced) {
    if (!extruder_) {
      return true;
    }
    const std::optional<NozzleMeasure> measured = try_plan(sliced, allowed_);
    return !measured || std::ranges::max(measured->width) <= kKept;
  }

  // Each repair moves all nodes behind it along the path, which may break what was kept by a hair.
  // So in a long run a little more counts as kept with each repair.
  [[nodiscard]] bool keeps(const NozzleMeasure& measured, int repaired) const {
    return std::ranges::max(measured.error) <= kKept + kMoreError * repaired &&
           std::ranges::max(measured.speed) <= kKeptFeed + kMoreSpeed * repaired &&
           std::ranges::max(measured.width) <= kKept + kMoreError * repaired &&
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
    period_s_ = grid.period_s;
    starts_s_ = planner::starts_s(plan, compensate::origin_s(course, grid, setup_));
    NozzleMeasure measured = measure(plan, bounds, starts_s_, *base, models_, allowances_,
                                     course.before.empty() ? &nozzle_ : nullptr, extruder_);
    if (!course.after.empty() || goal_ == Goal::feed) {
      measured.left.assign(models_.size(), 0.0);
    }
    if (goal_ == Goal::feed) {
      std::ranges::fill(measured.error, 0.0);
    }
    return measured;
  }

  // Where the axes may be several things, the nozzle of one may stray more than its tolerance even
  // in the timing as sliced. There it may stray as far as that.
  void allow_as_sliced() {
    constexpr double kSampling = 1.02;
    const std::optional<NozzleMeasure> sliced = try_plan(course_.moves, allowed_);
    if (!sliced) {
      return;
    }
    allowances_.resize(models_.size());
    for (std::size_t m = 0; m < models_.size(); ++m) {
      for (std::size_t i = 0; i < pieces_.counts.size(); ++i) {
        allowances_[m].insert(allowances_[m].end(), pieces_.counts[i],
                              std::max(kSampling * sliced->of_pieces[m][i], 1.0));
      }
      left_allowed_.push_back(std::max(kSampling * sliced->left[m], 1.0));
    }
  }

  // The largest swing in the end, relative to what is allowed.
  [[nodiscard]] double left_of(const NozzleMeasure& measured) const {
    double left = 0.0;
    for (std::size_t m = 0; m < measured.left.size(); ++m) {
      left = std::max(left, measured.left[m] / (left_allowed_.empty() ? 1.0 : left_allowed_[m]));
    }
    return left;
  }

  // The largest values near each piece and near each vertex.
  struct Near {
    std::vector<double> piece;
    std::vector<double> vertex;
  };

  [[nodiscard]] Near largest_near(const std::vector<double>& of_nodes, double reach_s) const {
    const std::size_t count = pieces_.moves.size();
    Near near{std::vector<double>(count, 0.0), std::vector<double>(count + 1, 0.0)};
    std::size_t first = 0;
    for (std::size_t k = 0; k < of_nodes.size(); ++k) {
      const double t = static_cast<double>(k) * period_s_;
      while (first + 1 < count && starts_s_[first + 1] < t - reach_s) {
        ++first;
      }
      for (std::size_t i = first; i < count && starts_s_[i] <= t + reach_s; ++i) {
        near.piece[i] = std::max(near.piece[i], of_nodes[k]);
        if (starts_s_[i] >= t - reach_s) {
          near.vertex[i] = std::max(near.vertex[i], of_nodes[k]);
        }
      }
    }
    return near;
  }

  void rescale(const std::vector<planner::PlannedMove>& plan, const NozzleMeasure& measured,
               int round, int repaired) {
    const bool repairs = repaired > 0;
    const double cooled = math::power(kCooling, round);
    const double alpha = repairs ? kAlphaOfRepairs : kAlpha * cooled;
    const double beta = repairs ? kBetaOfRepairs : kBeta * cooled;
    const double most = repairs ? 1.0 : kMostFactor;
    const double reach = kErrorReach * (1.0 + kWider * std::max(repaired - 1, 0));
    const Near error = largest_near(measured.error, reach / omega_rad_s_);
    const Near speed = largest_near(measured.speed, kSpeedReach / omega_rad_s_);
    const Near width = largest_near(measured.width, kWidthReach_s);
    const double left = std::min(left_of(measured), kMostLeft);
    for (std::size_t i = 1; i < plan.size(); ++i) {
      const double g = error.vertex[i] / kAim;
      const double v = plan[i].start_v_mm_s;
      const bool is_bound = v > 0.97 * vertex_mm_s_[i];
      if (!is_kept_[i - 1] && !is_kept_[i] && (g > 1.0 || is_bound)) {
        vertex_mm_s_[i] = std::min(
            std::max(std::min(vertex_mm_s_[i], g > 1.0 ? v : planner::kNoLimit) *
                         std::min(scale(g, alpha), most),
                     kLeastSpeed_mm_s),
            std::min(pieces_.bounds[i - 1].end_speed_mm_s, pieces_.bounds[i].start_speed_mm_s));
      }
    }
    for (std::size_t i = 0; i < plan.size(); ++i) {
      if (is_kept_[i]) {
        continue;
      }
      const bool is_near_end = starts_s_.back() - starts_s_[i + 1] < kEndReach / omega_rad_s_;
      const double g = std::max(error.piece[i], is_near_end ? left : 0.0) / kAim;
      const double of_width = width.piece[i] / kAim;
      MoveBounds& own = bounds_[i];
      const MoveBounds& allowed = pieces_.bounds[i];
      if (plan[i].accel_s + plan[i].decel_s > 0.0) {
        double factor = std::min(scale(g, beta), most);
        if (of_width > 1.0) {
          factor = std::min(factor, scale(of_width, kGamma));
        }
        own.accel_mm_s2 = std::min(allowed.accel_mm_s2, own.accel_mm_s2 * factor);
      }
      const double ahead = speed.piece[i] / kAimOfFeed;
      const double of_speed = repaired > kMendsByAccel ? std::max(g, of_width) : g;
      if (repairs && of_speed > 1.0) {
        own.speed_mm_s = std::max(plan[i].cruise_v_mm_s * scale(of_speed, alpha), kLeastSpeed_mm_s);
      }
      if (ahead > 1.0) {
        own.speed_mm_s = std::max(plan[i].cruise_v_mm_s * std::max(1.0 / ahead, kLeastSpeedFactor),
                                  kLeastSpeed_mm_s);
      } else if (!repairs && plan[i].cruise_v_mm_s > 0.99 * own.speed_mm_s) {
        own.speed_mm_s =
            std::min(allowed.speed_mm_s, own.speed_mm_s * std::min(1.0 / ahead, kMostSpeedFactor));
      }
    }
  }

  // The engine finds no base for so quick a plan.
  void slow_down() {
    constexpr double kSlower = 0.7;
    for (std::size_t i = 0; i < bounds_.size(); ++i) {
      if (!is_kept_[i]) {
        bounds_[i].accel_mm_s2 *= kSlower;
        vertex_mm_s_[i] *= kSlower;
      }
    }
  }

  Goal goal_;
  compensate::Course course_;
  compensate::Setup setup_;
  const dynamics::NozzleXY& nozzle_;
  const compensate::Engine& engine_;
  std::optional<Extruder> extruder_;
  std::vector<AxesModel> models_;
  ModelShares shares_{setup_};
  double omega_rad_s_;
  std::vector<bool> is_kept_;  // of each piece
  Allowances allowances_;
  std::vector<double> left_allowed_;  // for each model; empty: 1
  std::vector<MoveBounds> allowed_;   // of the moves
  Pieces pieces_;                     // with what each may do
  std::vector<MoveBounds> bounds_;
  std::vector<double> vertex_mm_s_;
  double period_s_ = 0.0;         // of the last plan's nodes
  std::vector<double> starts_s_;  // of the last plan's pieces, and the end of the last one
};

// Whether lines go evenly below their speed for so long that it matters.
bool is_slow_on_long_lines(const Timed& timed, std::span<const MoveBounds> bounds) {
  constexpr double kMatters = 0.04;
  double lost_s = 0.0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < timed.pieces.size(); ++i) {
    for (const std::size_t end = next + timed.pieces[i]; next < end; ++next) {
      const planner::PlannedMove& piece = timed.moves[next];
      lost_s += piece.cruise_s * std::max(0.0, 1.0 - piece.cruise_v_mm_s / bounds[i].speed_mm_s);
    }
  }
  return lost_s > kMatters * planner::duration_s(timed.moves);
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
  std::optional<Timed> found = find(kPieces);
  if (found && is_slow_on_long_lines(*found, bounds)) {
    std::optional<Timed> other = find(kMorePieces);
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
  LocalScaling scaling(Goal::feed, course, setup, nozzle, as_sliced, engine, {}, kFeedPieces);
  return scaling.keeps_feed_as_sliced(as_sliced) ? std::nullopt : scaling.find();
}

}  // namespace unflex::timing
