#include "nozzle_measure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace unflex::timing {
namespace {

using gcode::X;
using gcode::Y;

// A nozzle that passes a corner is nearest to it, or farthest from the path, for less than a node
// period. So we look several times per node.
constexpr int kLooks = 4;
constexpr double kBetweenLooks[] = {0.25, 0.5, 0.75};
// How far from its time the path counts as near.
constexpr double kReach_s = 31e-3;

// The base between a node and the next, a look further. Its acceleration is linear there, and the
// mean over the time to the next look serves the nozzle.
dynamics::BaseSegment segment_of(const dynamics::AxisTrajectory& base, std::size_t node, int look,
                                 double h) {
  const dynamics::AxisMotion at = dynamics::between(base, node, look * h / kLooks, h);
  const double change = base.accel_mm_s2[node + 1] - base.accel_mm_s2[node];
  return {at.position_mm, at.velocity_mm_s,
          base.accel_mm_s2[node] + (look + 0.5) / kLooks * change};
}

struct Nearest {
  double distance_mm = 0.0;
  std::size_t piece = 0;
};

Nearest nearest(std::span<const planner::PlannedMove> plan, std::size_t first, std::size_t end,
                double x_mm, double y_mm) {
  double least = std::numeric_limits<double>::infinity();
  std::size_t at = first;
  for (std::size_t i = first; i < end; ++i) {
    const gcode::Segment& segment = plan[i].segment;
    const double dx = plan[i].direction[X];
    const double dy = plan[i].direction[Y];
    const double px = x_mm - segment.start_mm[X];
    const double py = y_mm - segment.start_mm[Y];
    const double flat2 = dx * dx + dy * dy;
    const double along =
        flat2 > 0.0 ? std::clamp((px * dx + py * dy) / flat2, 0.0, plan[i].length_mm) : 0.0;
    const double across_x = px - along * dx;
    const double across_y = py - along * dy;
    const double distance2 = across_x * across_x + across_y * across_y;
    if (distance2 < least) {
      least = distance2;
      at = i;
    }
  }
  return {std::sqrt(least), at};
}

double swing_mm(const dynamics::FlexibleAxis& axis, const dynamics::NozzleState& nozzle,
                double base_mm) {
  const dynamics::FlexibleAxis::Gap gap = axis.gap(nozzle, axis.riding(base_mm));
  return std::hypot(gap.place_mm, gap.speed_mm);
}

class Walk {
 public:
  Walk(std::span<const planner::PlannedMove> plan, std::span<const MoveBounds> bounds,
       std::span<const double> starts_s, const dynamics::BaseTrajectory& base)
      : plan_(plan), bounds_(bounds), starts_s_(starts_s), base_(base) {}

  // may_be_left: the swing in the end that counts as 1, relative to the tolerance.
  void add(const AxesModel& model, dynamics::NozzleXY nozzle, double may_be_left,
           NozzleMeasure& result) const {
    const double h = base_.period_s;
    const dynamics::ExactMap map_x(model.x, h / kLooks);
    const dynamics::ExactMap map_y(model.y, h / kLooks);
    std::size_t now = 0;    // the piece that the plan is on
    std::size_t first = 0;  // pieces within reach
    std::size_t end = 0;
    dynamics::NozzleMotionXY last = nozzle.motion();
    std::size_t last_piece = 0;
    for (std::size_t node = 0; node + 1 < base_.nodes(); ++node) {
      for (int look = 0; look < kLooks; ++look) {
        map_x.advance(segment_of(base_.x, node, look, h), nozzle.x);
        map_y.advance(segment_of(base_.y, node, look, h), nozzle.y);
        const double t = (static_cast<double>(node) + (look + 1.0) / kLooks) * h;
        if (t < starts_s_.front() || t > starts_s_.back()) {
          continue;
        }
        while (now + 1 < plan_.size() && starts_s_[now + 1] <= t) {
          ++now;
        }
        while (starts_s_[first + 1] < t - kReach_s) {
          ++first;
        }
        while (end < plan_.size() && starts_s_[end] <= t + kReach_s) {
          ++end;
        }
        const dynamics::NozzleMotionXY at = nozzle.motion();
        const Nearest place = nearest(plan_, first, end, at.x.position, at.y.position);
        const double speed_mm_s = std::hypot(at.x.velocity, at.y.velocity);
        note(place, now, speed_mm_s, node + 1, result);
        if (place.piece != last_piece) {
          // The error is largest where the nearest piece changes.
          for (const double share : kBetweenLooks) {
            const double x_mm = last.x.position + share * (at.x.position - last.x.position);
            const double y_mm = last.y.position + share * (at.y.position - last.y.position);
            note(nearest(plan_, first, end, x_mm, y_mm), now, speed_mm_s, node + 1, result);
          }
        }
        last_piece = place.piece;
        last = at;
      }
    }
    const double left_mm = std::hypot(swing_mm(model.x, nozzle.x, base_.x.position_mm.back()),
                                      swing_mm(model.y, nozzle.y, base_.y.position_mm.back()));
    result.left = std::max(result.left, left_mm / (may_be_left * bounds_.back().tolerance_mm));
  }

 private:
  void note(const Nearest& place, std::size_t now, double speed_mm_s, std::size_t node,
            NozzleMeasure& result) const {
    const bool lays = plan_[place.piece].segment.extruding();
    const double tolerance_mm =
        lays || plan_[now].segment.extruding()
            ? std::min(bounds_[place.piece].tolerance_mm, bounds_[now].tolerance_mm)
            : kTravelTolerance_mm;
    result.error[node] = std::max(result.error[node], place.distance_mm / tolerance_mm);
    if (lays) {
      result.speed[node] =
          std::max(result.speed[node], speed_mm_s / plan_[place.piece].segment.feed_mm_s);
    }
  }

  std::span<const planner::PlannedMove> plan_;
  std::span<const MoveBounds> bounds_;
  std::span<const double> starts_s_;
  const dynamics::BaseTrajectory& base_;
};

}  // namespace

std::vector<AxesModel> models_of(const compensate::Setup& setup) {
  // Models of hardly any share only keep the base from moving more than it must.
  constexpr double kLeastShare = 0.05;
  const auto of = [](const compensate::AxisSetup& axis) {
    std::vector<dynamics::FlexibleAxis> models = {axis.axis};
    for (const compensate::Plant& plant : axis.plants) {
      if (plant.share >= kLeastShare) {
        models.push_back(plant.axis);
      }
    }
    return models;
  };
  const std::vector<dynamics::FlexibleAxis> x = of(setup.x);
  const std::vector<dynamics::FlexibleAxis> y = of(setup.y);
  std::vector<AxesModel> models;
  for (std::size_t i = 0; i < std::max(x.size(), y.size()); ++i) {
    models.push_back({x[i < x.size() ? i : 0], y[i < y.size() ? i : 0]});
  }
  return models;
}

NozzleMeasure measure(std::span<const planner::PlannedMove> plan,
                      std::span<const MoveBounds> bounds, std::span<const double> starts_s,
                      const dynamics::BaseTrajectory& base, const std::vector<AxesModel>& models,
                      const dynamics::NozzleXY* nozzle) {
  NozzleMeasure result;
  result.error.assign(base.nodes(), 0.0);
  result.speed.assign(base.nodes(), 0.0);
  const Walk walk(plan, bounds, starts_s, base);
  const dynamics::AxisMotion x = base.x_at(0.0);
  const dynamics::AxisMotion y = base.y_at(0.0);
  for (const AxesModel& model : models) {
    dynamics::NozzleXY start{model.x.riding(x.position_mm, x.velocity_mm_s),
                             model.y.riding(y.position_mm, y.velocity_mm_s)};
    if (nozzle != nullptr) {
      start = {model.x.swinging_as(models.front().x, nozzle->x, x.position_mm),
               model.y.swinging_as(models.front().y, nozzle->y, y.position_mm)};
    }
    constexpr double kByFirst = 0.5;
    walk.add(model, start, &model == &models.front() ? kByFirst : 1.0, result);
  }
  return result;
}

}  // namespace unflex::timing
