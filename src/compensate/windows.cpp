#include <algorithm>
#include <array>
#include <cmath>

#include "contour.hpp"
#include "unflex/compensate/run.hpp"
#include "unflex/core/math.hpp"
#include "unflex/planner/plan_times.hpp"

namespace unflex::compensate {
namespace {

// r and its weight; times must not decrease from call to call.
class Reference {
 public:
  // origin_s: when the course's own moves begin.
  Reference(const Course& course, double origin_s, const Setup& setup)
      : travel_weight_(setup.travel_weight), starts_s_{origin_s} {
    for (const planner::PlannedMove& move : course.before) {
      starts_s_.front() -= move.duration_s();
    }
    for (const Course::Moves& moves : {course.before, course.moves, course.after}) {
      for (const planner::PlannedMove& move : moves) {
        moves_.push_back(&move);
        starts_s_.push_back(starts_s_.back() + move.duration_s());
      }
    }
  }

  struct Sample {
    XY place_mm;
    double weight;
  };

  Sample at(double t) {
    now_ = planner::move_at(starts_s_, t, now_);
    const planner::PlannedMove& move = *moves_[now_];
    const bool moving = t >= starts_s_[now_] && t <= starts_s_[now_ + 1];
    return {xy_of(move.position_mm(t - starts_s_[now_])),
            moving && move.segment.extruding() ? 1.0 : travel_weight_};
  }

 private:
  double travel_weight_;
  std::vector<const planner::PlannedMove*> moves_;
  std::vector<double> starts_s_;
  std::size_t now_ = 0;
};

// One axis of a window, without the conditions at the window's ends.
AxisWindow make_axis(const AxisSetup& axis, const Setup& setup, double period_s,
                     std::vector<double> reference, std::vector<double> weight) {
  AxisWindow window;
  window.axis = axis.axis;
  window.plants = axis.plants;
  window.period_s = period_s;
  // The effect of the base's jerk on the nozzle's motion goes with (ωh)². With this weight one
  // value serves all resonances.
  window.jerk_weight = setup.jerk_weight * math::power(axis.axis.main_rad_s() * period_s, 4);
  window.limits = axis.limits;
  // If the sliced path itself leaves the travel, the base may go as far but no further.
  const auto [low, high] = std::ranges::minmax(reference);
  window.limits.min_position_mm = std::min(window.limits.min_position_mm, low);
  window.limits.max_position_mm = std::max(window.limits.max_position_mm, high);
  window.reference_mm = std::move(reference);
  window.weight = std::move(weight);
  return window;
}

// Takes the frequencies over the bed into an axis' window. places_mm: r of all axes at its samples.
// Where the frequencies hardly change, their mean serves the whole window.
void take_field(const dynamics::FrequencyField& field, const Axes<std::vector<double>>& places_mm,
                AxisWindow& window) {
  constexpr double kHardly = 2e-3;
  if (field.is_even()) {
    return;
  }
  std::vector<double> shares;
  for (std::size_t i = 0; i < places_mm.x.size(); ++i) {
    shares.push_back(field.at({places_mm.x[i], places_mm.y[i]}));
  }
  const auto [low, high] = std::ranges::minmax(shares);
  if (high > (1.0 + kHardly) * low) {
    window.freq_shares = std::move(shares);
    return;
  }
  const double mean = 0.5 * (low + high);
  window.axis = window.axis.detuned(mean);
  for (Plant& plant : window.plants) {
    plant.axis = plant.axis.detuned(mean);
  }
}

// A place in the coordinates in which the setup's axes are apart. Heights count from the plan's.
std::array<double, 3> in_coordinates(const Setup& setup, const XY& place_mm) {
  const std::array<double, 3> place = {place_mm.x, place_mm.y, 0.0};
  return setup.frame ? setup.frame->to_modes(place) : place;
}

dynamics::NozzleState start_of_mode(const dynamics::NozzleXY& nozzle, std::size_t mode,
                                    double base_mm) {
  const dynamics::NozzleMotion& part = nozzle.x.parts[mode];
  return {{dynamics::NozzleMotion{base_mm + part.position, part.velocity}}};
}

// The nozzle at the beginning of a window whose base rests at base_mm. Both are in the coordinates
// in which the setup's axes are apart.
dynamics::NozzleXY start_of(const dynamics::NozzleXY& nozzle, const Setup& setup,
                            const XY& base_mm) {
  if (!setup.frame) {
    return nozzle;
  }
  dynamics::NozzleXY start;
  for (std::size_t i = 0; i < XY::kCount; ++i) {
    start[i] = start_of_mode(nozzle, i, base_mm[i]);
  }
  return start;
}

// Raises the weights around the end of a run. first_sample: where they begin.
void weigh_end(const Course& course, const Setup& setup, const NodeGrid& grid,
               std::size_t first_sample, std::vector<double>& weight) {
  constexpr double kAroundEnd_s = 3e-3;
  const double end_s = origin_s(course, grid, setup) + planner::duration_s(course.moves);
  for (std::size_t i = 0; i < weight.size(); ++i) {
    const double t = 0.5 * static_cast<double>(first_sample + i) * grid.period_s;
    if (std::abs(t - end_s) <= kAroundEnd_s) {
      weight[i] = std::max(weight[i], setup.end_weight);
    }
  }
}

}  // namespace

Plant AxisWindow::model(std::size_t i) const {
  if (i > 0) {
    return plants[i - 1];
  }
  double share = 1.0;
  for (const Plant& plant : plants) {
    share -= plant.share;
  }
  return {axis, share};
}

dynamics::NozzleState AxisWindow::in_model(std::size_t i, const dynamics::NozzleState& nozzle,
                                           double base_mm) const {
  const dynamics::FlexibleAxis& other = i > 0 ? plants[i - 1].axis : axis;
  return other.swinging_as(axis, nozzle, base_mm);
}

std::vector<RunWindow> windows(const Course& course, const std::vector<WindowSpan>& spans,
                               const dynamics::NozzleXY& nozzle, const Setup& setup) {
  return windows(course, spans, 0, spans.size(), nozzle, setup);
}

std::vector<RunWindow> windows(const Course& course, const std::vector<WindowSpan>& spans,
                               std::size_t first, std::size_t count,
                               const dynamics::NozzleXY& nozzle, const Setup& setup) {
  const NodeGrid grid = node_grid(course, setup);
  // Twice as many samples as nodes, from the first node of the first window.
  const std::size_t first_sample = 2 * spans[first].first;
  const std::size_t last_sample = 2 * spans[first + count - 1].last;
  Axes<std::vector<double>> reference_mm;
  std::vector<double> third_mm;
  std::vector<double> weight;
  const bool from_rest = course.before.empty();
  Reference reference(course, origin_s(course, grid, setup), setup);
  for (std::size_t i = first_sample; i <= last_sample; ++i) {
    const Reference::Sample sample = reference.at(0.5 * static_cast<double>(i) * grid.period_s);
    const std::array<double, 3> place_mm = in_coordinates(setup, sample.place_mm);
    for_each_axis([](std::vector<double>& all, double place) { all.push_back(place); },
                  reference_mm, xy_of(place_mm));
    third_mm.push_back(place_mm[2]);
    weight.push_back(sample.weight);
  }
  if (course.after.empty()) {
    weigh_end(course, setup, grid, first_sample, weight);
  }
  std::vector<PathVertex> path;
  if (setup.contour) {
    path = path_of(course, origin_s(course, grid, setup), grid.period_s);
  }
  std::vector<RunWindow> result;
  for (std::size_t w = first; w < first + count; ++w) {
    const WindowSpan& span = spans[w];
    const auto slice = [&](const std::vector<double>& all) {
      return std::vector<double>(
          all.begin() + static_cast<std::ptrdiff_t>(2 * span.first - first_sample),
          all.begin() + static_cast<std::ptrdiff_t>(2 * span.last + 1 - first_sample));
    };
    const Axes<std::vector<double>> places_mm = map_axes(slice, reference_mm);
    RunWindow window{map_axes(
                         [&](const AxisSetup& axis, const std::vector<double>& of_axis_mm) {
                           AxisWindow made =
                               make_axis(axis, setup, grid.period_s, of_axis_mm, slice(weight));
                           take_field(axis.field, places_mm, made);
                           return made;
                         },
                         setup, places_mm),
                     setup.shares_motors,
                     setup.contour,
                     {},
                     setup.frame};
    if (setup.contour) {
      window.path = part_of(path, 2 * span.first, window.x.reference_mm.size(),
                            2.0 * setup.contour->reach_s / grid.period_s);
    }
    if (setup.third) {
      window.third = make_axis(*setup.third, setup, grid.period_s, slice(third_mm), slice(weight));
      window.motors = setup.motors;
    }
    if (from_rest && span.first == 0) {
      for_each_axis(
          [](AxisWindow& axis, const dynamics::NozzleState& state) {
            axis.start = AxisWindow::Start{state, axis.reference_mm.front()};
          },
          window,
          start_of(nozzle, setup, {window.x.reference_mm.front(), window.y.reference_mm.front()}));
    }
    if (window.third && from_rest && span.first == 0) {
      const double at_mm = window.third->reference_mm.front();
      window.third->start = AxisWindow::Start{start_of_mode(nozzle, 2, at_mm), at_mm};
    }
    if (course.after.empty() && span.last == spans.back().last) {
      const auto rest = [](AxisWindow& axis) { axis.end_base_mm = axis.reference_mm.back(); };
      for_each_axis(rest, window);
      if (window.third) {
        rest(*window.third);
      }
    }
    result.push_back(std::move(window));
  }
  return result;
}

}  // namespace unflex::compensate
