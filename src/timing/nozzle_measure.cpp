#include "nozzle_measure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "laid_width.hpp"
#include "unflex/core/foot.hpp"
#include "unflex/core/math.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/planner/plan_times.hpp"

namespace unflex::timing {
namespace {

// A nozzle that passes a corner is nearest to it, or farthest from the path, for less than a node
// period. So we look several times per node.
constexpr int kLooks = 4;
constexpr double kBetweenLooks[] = {0.25, 0.5, 0.75};
// The share of the distance along the path that counts, as where filament is laid
// (emit/nozzle_progress.cpp).
constexpr double kTowardsReference = 0.01;
// Lines of G-code lay a little less evenly than is foreseen, so only this share of the tolerance of
// the width is used.
constexpr double kOfLines = 0.86;
// Lines do not end exactly where filament does, so a little of it may come a node earlier or later.
// There the nozzle may stray this many times the tolerance.
constexpr double kBeside = 1.5;
// The looks of this many nodes are found at once, for all nozzles together.
constexpr std::size_t kNodesAtOnce = 128;

// The base between a node and the next, a look further. Its acceleration is linear there, and the
// mean over the time to the next look serves the nozzle.
dynamics::BaseSegment segment_of(const dynamics::AxisTrajectory& base, std::size_t node, int look,
                                 double h) {
  const dynamics::AxisMotion at = dynamics::between(base, node, look * h / kLooks, h);
  const double change = base.accel_mm_s2[node + 1] - base.accel_mm_s2[node];
  return {at.position_mm, at.velocity_mm_s,
          base.accel_mm_s2[node] + (look + 0.5) / kLooks * change};
}

// Where a nozzle is on the path.
struct Place {
  double error_mm = 0.0;  // distance to the nearest place, wherever that is
  // The place up to which filament is laid.
  double progress_mm = 0.0;
  std::size_t piece = 0;
};

class Walk {
 public:
  Walk(std::span<const planner::PlannedMove> plan, std::span<const MoveBounds> bounds,
       std::span<const double> starts_s, const dynamics::BaseTrajectory& base)
      : plan_(plan),
        bounds_(bounds),
        starts_s_(starts_s),
        base_(base),
        from_mm_{0.0},
        filament_mm_{0.0} {
    for (const planner::PlannedMove& move : plan) {
      from_mm_.push_back(from_mm_.back() + move.length_mm);
      filament_mm_.push_back(filament_mm_.back() + move.length_mm * filament_per_mm(move));
      const double flat2 = squared(xy_of(move.direction));
      inverse_flat2_.push_back(flat2 > 0.0 ? 1.0 / flat2 : 0.0);
    }
  }

  // Where the nozzle is on the path at each node, and what is laid up to there.
  struct Laid {
    std::vector<double> way_mm;
    std::vector<double> filament_mm;
  };

  // A nozzle at a node.
  struct AtNode {
    double error_mm = 0.0;
    double speed_mm_s = 0.0;
    // Tolerance and F of the pieces on which the nozzle lays filament.
    double tolerance_mm = std::numeric_limits<double>::infinity();
    double feed_mm_s = std::numeric_limits<double>::infinity();
    double travel_mm_s = std::numeric_limits<double>::infinity();  // on the other pieces
  };

  // Data that all nozzles share between two looks.
  struct Look {
    Axes<dynamics::BaseSegment> base;
    // The piece that the plan is on at the end of the look, and the plan's place on the path then.
    // nullopt: the plan has not begun, or has ended.
    std::optional<std::size_t> now;
    double reference_mm = 0.0;
  };
  // Finds the looks behind each of these nodes. They continue the looks of the previous call.
  void look(std::size_t first_node, std::size_t last_node, std::vector<Look>& looks) {
    const double h = base_.period_s;
    looks.clear();
    for (std::size_t node = first_node; node < last_node; ++node) {
      for (int i = 0; i < kLooks; ++i) {
        Look& look = looks.emplace_back();
        look.base = map_axes(
            [&](const dynamics::AxisTrajectory& axis) { return segment_of(axis, node, i, h); },
            base_);
        const double t = (static_cast<double>(node) + (i + 1.0) / kLooks) * h;
        if (t < starts_s_.front() || t > starts_s_.back()) {
          continue;
        }
        now_ = planner::move_at(starts_s_, t, now_);
        look.now = now_;
        look.reference_mm = from_mm_[now_] + plan_[now_].distance_mm(t - starts_s_[now_]);
      }
    }
  }

  // A nozzle on its way.
  class Nozzle {
   public:
    // allowance: for each piece; empty: 1. laid: nullptr if nobody asks for it.
    Nozzle(const Walk& walk, const AxesModel& model, const dynamics::NozzleXY& start,
           std::span<const double> allowance, Laid* laid)
        : walk_(&walk),
          model_(&model),
          allowance_(allowance),
          laid_(laid),
          maps_(map_axes(
              [&](const dynamics::FlexibleAxis& axis, const dynamics::FrequencyField& field) {
                return Maps(axis, field, walk.base_.period_s / kLooks);
              },
              model, model.field)),
          nozzle_(start),
          last_mm_(dynamics::place_mm(start)),
          nodes_(1),
          of_pieces_(walk.plan_.size(), 0.0) {
      note_laid();
    }

    // Goes on to the ends of these looks.
    void go(std::span<const Look> looks, NozzleMeasure& result) {
      for (std::size_t i = 0; i < looks.size(); ++i) {
        if (i % kLooks == 0) {
          nodes_.emplace_back();
        }
        const Look& look = looks[i];
        const XY from_mm = dynamics::place_mm(look.base);
        for_each_axis(
            [&](Maps& maps, const dynamics::BaseSegment& base, dynamics::NozzleState& nozzle) {
              maps.at(from_mm).advance(base, nozzle);
            },
            maps_, look.base, nozzle_);
        if (look.now) {
          see(*look.now, look.reference_mm);
        }
        if (i % kLooks + 1 == kLooks) {
          note_laid();
        }
      }
      settle(nodes_.size() - 1, result);
    }

    // may_be_left: the swing in the end that counts as 1, relative to the tolerance.
    void end(double may_be_left, NozzleMeasure& result) {
      settle(nodes_.size(), result);
      const double left_mm = length(map_axes(
          [](const dynamics::FlexibleAxis& axis, const dynamics::NozzleState& nozzle,
             const dynamics::AxisTrajectory& base) {
            return swing_mm(axis, nozzle, base.position_mm.back());
          },
          *model_, nozzle_, walk_->base_));
      result.left.push_back(left_mm / (may_be_left * walk_->bounds_.back().tolerance_mm));
      result.of_pieces.push_back(std::move(of_pieces_));
    }

   private:
    using Maps = dynamics::FieldMaps<dynamics::ExactMap>;

    void see(std::size_t now, double reference_mm) {
      const XY at_mm = dynamics::place_mm(nozzle_);
      const XY velocity_mm_s =
          map_axes([](const dynamics::NozzleState& nozzle) { return nozzle.velocity(); }, nozzle_);
      const double speed_mm_s = std::sqrt(squared(velocity_mm_s));
      const std::size_t last_piece = furthest_.piece;
      const Place ahead = walk_->place(now, at_mm, reference_mm);
      if (ahead.piece != last_piece) {
        // The error may be largest where the piece changes.
        for (const double share : kBetweenLooks) {
          take(walk_->place(now, last_mm_ + share * (at_mm - last_mm_), reference_mm), speed_mm_s);
        }
      }
      take(ahead, speed_mm_s);
      last_mm_ = at_mm;
    }

    void take(Place found, double speed_mm_s) {
      // Filament is never laid backwards.
      if (found.progress_mm < furthest_.progress_mm) {
        found.progress_mm = furthest_.progress_mm;
        found.piece = furthest_.piece;
      }
      furthest_ = found;
      walk_->note(found, speed_mm_s, allowance_, nodes_.back());
      const double tolerance_mm =
          model_->times_tolerance * walk_->bounds_[found.piece].tolerance_mm;
      of_pieces_[found.piece] = std::max(of_pieces_[found.piece], found.error_mm / tolerance_mm);
    }

    void note_laid() {
      if (laid_ != nullptr) {
        walk_->note(furthest_, *laid_);
      }
    }

    // Adds the nodes before the `until`-th of nodes_, whose neighbours are known, to the result.
    void settle(std::size_t until, NozzleMeasure& result) {
      for (; settled_ < until; ++settled_) {
        walk_->add(nodes_, settled_, first_ + settled_, model_->times_tolerance, result);
      }
      // The next node needs the last settled node beside it.
      const std::size_t dropped = settled_ > 0 ? settled_ - 1 : 0;
      nodes_.erase(nodes_.begin(), nodes_.begin() + static_cast<std::ptrdiff_t>(dropped));
      settled_ -= dropped;
      first_ += dropped;
    }

    const Walk* walk_;
    const AxesModel* model_;
    std::span<const double> allowance_;
    Laid* laid_;
    Axes<Maps> maps_;
    dynamics::NozzleXY nozzle_;
    XY last_mm_;
    Place furthest_;
    std::vector<AtNode> nodes_;  // from the first_ on
    std::size_t first_ = 0;
    std::size_t settled_ = 0;  // how many of nodes_ are part of the result
    std::vector<double> of_pieces_;
  };

 private:
  // Filament is laid up to the nearest place. Where the path comes back to itself, as travel does
  // along what was just laid, that is the one nearer to the reference, which is on the piece `now`.
  [[nodiscard]] Place place(std::size_t now, const XY& at_mm, double reference_mm) const {
    double nearest2 = std::numeric_limits<double>::infinity();
    double least = std::numeric_limits<double>::infinity();
    Place found;
    const auto look_at = [&](std::size_t i) {
      const XY direction = xy_of(plan_[i].direction);
      const XY from_start = at_mm - xy_of(plan_[i].segment.start_mm);
      const Foot foot = foot_on(from_start, direction, plan_[i].length_mm, inverse_flat2_[i]);
      const double ahead_mm = from_mm_[i] + foot.along_mm - reference_mm;
      const double cost = foot.distance2_mm2 + kTowardsReference * ahead_mm * ahead_mm;
      nearest2 = std::min(nearest2, foot.distance2_mm2);
      if (cost < least) {
        least = cost;
        found.progress_mm = from_mm_[i] + foot.along_mm;
        found.piece = i;
      }
    };
    // Farther away along the path, that distance alone would cost more.
    const auto reaches = [&](double away_mm) {
      return kTowardsReference * away_mm * away_mm <= least;
    };
    look_at(now);
    for (std::size_t i = now; i > 0 && reaches(reference_mm - from_mm_[i]);) {
      look_at(--i);
    }
    for (std::size_t i = now + 1; i < plan_.size() && reaches(from_mm_[i] - reference_mm); ++i) {
      look_at(i);
    }
    found.error_mm = std::sqrt(nearest2);
    return found;
  }

  [[nodiscard]] static double filament_per_mm(const planner::PlannedMove& move) {
    return move.segment.extruding() ? move.direction[gcode::E] : 0.0;
  }

  void note(const Place& at, Laid& laid) const {
    laid.way_mm.push_back(at.progress_mm);
    laid.filament_mm.push_back(filament_mm_[at.piece] + (at.progress_mm - from_mm_[at.piece]) *
                                                            filament_per_mm(plan_[at.piece]));
  }

  void note(const Place& at, double speed_mm_s, std::span<const double> allowance,
            AtNode& node) const {
    node.error_mm = std::max(node.error_mm, at.error_mm);
    node.speed_mm_s = std::max(node.speed_mm_s, speed_mm_s);
    if (const gcode::Segment& segment = plan_[at.piece].segment; segment.extruding()) {
      const double times = allowance.empty() ? 1.0 : allowance[at.piece];
      node.tolerance_mm = std::min(node.tolerance_mm, times * bounds_[at.piece].tolerance_mm);
      node.feed_mm_s =
          std::min({node.feed_mm_s, segment.feed_mm_s, bounds_[at.piece].nozzle_speed_mm_s});
    } else {
      node.travel_mm_s = std::min(node.travel_mm_s, bounds_[at.piece].nozzle_speed_mm_s);
    }
  }

  // Adds a node, the i-th of `nodes` and the k-th of the base, to the result.
  void add(const std::vector<AtNode>& nodes, std::size_t i, std::size_t k, double times_tolerance,
           NozzleMeasure& result) const {
    const AtNode& node = nodes[i];
    double tolerance_mm = std::min(times_tolerance * node.tolerance_mm, kTravelTolerance_mm);
    for (const std::size_t beside : {i > 0 ? i - 1 : 0, std::min(i + 1, nodes.size() - 1)}) {
      tolerance_mm = std::min(tolerance_mm, kBeside * times_tolerance * nodes[beside].tolerance_mm);
    }
    result.error[k] = std::max(result.error[k], node.error_mm / tolerance_mm);
    if (times_tolerance == 1.0) {
      // In travel the base keeps F as well, since its motors are what F is for there.
      const XY of_base_mm_s = map_axes(
          [&](const dynamics::AxisTrajectory& axis) { return axis.velocity_mm_s[k]; }, base_);
      const double of_travel_mm_s = std::max(node.speed_mm_s, length(of_base_mm_s));
      result.speed[k] = std::max(
          {result.speed[k], node.speed_mm_s / node.feed_mm_s, of_travel_mm_s / node.travel_mm_s});
    }
  }

  std::span<const planner::PlannedMove> plan_;
  std::span<const MoveBounds> bounds_;
  std::span<const double> starts_s_;
  const dynamics::BaseTrajectory& base_;
  std::vector<double> from_mm_;        // length of the path before each piece
  std::vector<double> filament_mm_;    // laid on that length
  std::vector<double> inverse_flat2_;  // 1 / (d_x² + d_y²) of its direction; 0 if it is upright
  std::size_t now_ = 0;                // the piece that the plan is on
};

}  // namespace

double swing_mm(const dynamics::FlexibleAxis& axis, const dynamics::NozzleState& nozzle,
                double base_mm) {
  const dynamics::FlexibleAxis::Gap gap = axis.gap(nozzle, axis.riding(base_mm));
  return math::hypot(gap.place_mm, gap.speed_mm);
}

std::vector<AxesModel> models_of(const compensate::Setup& setup) {
  struct Model {
    dynamics::FlexibleAxis axis;
    double times_tolerance = 1.0;
  };
  using Models = std::vector<Model>;
  const auto of_axis = [](const compensate::AxisSetup& axis) {
    Models models = {{axis.axis}};
    for (const compensate::Plant& plant : axis.plants) {
      if (is_model(plant)) {
        models.push_back({plant.axis, plant.is_edge ? kTimesAtEdge : 1.0});
      }
    }
    return models;
  };
  const Axes<Models> all = map_axes(of_axis, setup);
  std::vector<AxesModel> models;
  const std::size_t count = most_of_axes([](const Models& each) { return each.size(); }, all);
  for (std::size_t i = 0; i < count; ++i) {
    const auto model =
        map_axes([&](const Models& each) { return each[i < each.size() ? i : 0]; }, all);
    models.push_back({map_axes([](const Model& each) { return each.axis; }, model),
                      most_of_axes([](const Model& each) { return each.times_tolerance; }, model),
                      compensate::field_of(setup)});
  }
  return models;
}

NozzleMeasure measure(std::span<const planner::PlannedMove> plan,
                      std::span<const MoveBounds> bounds, std::span<const double> starts_s,
                      const dynamics::BaseTrajectory& base, const std::vector<AxesModel>& models,
                      const Allowances& allowances, const dynamics::NozzleXY* nozzle,
                      const std::optional<Extruder>& extruder) {
  NozzleMeasure result;
  result.error.assign(base.nodes(), 0.0);
  result.width.assign(base.nodes(), 0.0);
  result.speed.assign(base.nodes(), 0.0);
  Walk walk(plan, bounds, starts_s, base);
  const XY begin_mm = base.position_mm(0.0);
  Walk::Laid laid;
  std::vector<Walk::Nozzle> nozzles;
  for (std::size_t m = 0; m < models.size(); ++m) {
    const AxesModel& model = models[m];
    dynamics::NozzleXY start = dynamics::riding(model, begin_mm, base.velocity_mm_s(0.0));
    if (nozzle != nullptr) {
      start = map_axes([](const dynamics::FlexibleAxis& axis, const dynamics::FlexibleAxis& first,
                          const dynamics::NozzleState& state,
                          double base_mm) { return axis.swinging_as(first, state, base_mm); },
                       model, models.front(), *nozzle, begin_mm);
    }
    nozzles.emplace_back(walk, model, start,
                         allowances.empty() ? std::span<const double>{} : allowances[m],
                         m == 0 && extruder ? &laid : nullptr);
  }
  std::vector<Walk::Look> looks;
  for (std::size_t first = 0; first + 1 < base.nodes(); first += kNodesAtOnce) {
    walk.look(first, std::min(first + kNodesAtOnce, base.nodes() - 1), looks);
    for (Walk::Nozzle& each : nozzles) {
      each.go(looks, result);
    }
  }
  constexpr double kByFirst = 0.5;
  for (Walk::Nozzle& each : nozzles) {
    each.end(&each == nozzles.data() ? kByFirst : 1.0, result);
  }
  if (extruder) {
    result.width = width_errors(laid.filament_mm, laid.way_mm, base.period_s, *extruder);
    for (double& width : result.width) {
      width /= kOfLines * extruder->width_tolerance;
    }
  }
  return result;
}

}  // namespace unflex::timing
