#include <algorithm>
#include <cmath>
#include <memory>

#include "nozzle_measure.hpp"
#include "pieces.hpp"
#include "section_motion.hpp"
#include "sections.hpp"
#include "timed_moves.hpp"
#include "tunings.hpp"
#include "unflex/planner/plan_times.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {
namespace {

using Tuned = OptimalTunings;

// First plans, in the order in which they are tried. Travel that wanders may come too near to the
// filament laid next, and the search from a plan that is too quick may fail.
constexpr FirstPlan kFirstPlans[] = {{0.5, kTravelTolerance_mm}, {0.5, 0.05}, {0.15, 0.05}};

// The rules for the sections by the models of the axes. nullopt: sections do not know such models.
std::optional<SectionRules> rules_of(const compensate::Setup& setup) {
  SectionRules rules;
  rules.max_accel_mm_s2 = setup.x.limits.max_accel_mm_s2;
  rules.shares_motors = setup.shares_motors;
  if (any_axis([](const compensate::AxisSetup& axis) { return axis.axis.mode_count() != 1; },
               setup)) {
    return std::nullopt;
  }
  for_each_axis(
      [](dynamics::Mode& mode, compensate::BaseLimits& limits, const compensate::AxisSetup& axis) {
        mode = axis.axis.main();
        limits = axis.limits;
      },
      rules, rules.limits, setup);
  using Edges = std::vector<dynamics::FlexibleAxis>;
  const auto edges_of = [](const compensate::AxisSetup& axis) {
    Edges edges;
    for (const compensate::Plant& plant : axis.plants) {
      if (is_model(plant) && plant.is_edge) {
        edges.push_back(plant.axis);
      }
    }
    return edges;
  };
  const auto knows = [](const compensate::AxisSetup& axis) {
    return std::ranges::all_of(axis.plants, [](const compensate::Plant& plant) {
      return !is_model(plant) || (plant.is_edge && plant.axis.mode_count() == 1);
    });
  };
  if (!all_axes(knows, setup)) {
    return std::nullopt;
  }
  const Axes<Edges> edges = map_axes(edges_of, setup);
  const auto size = [](const Edges& of_axis) { return of_axis.size(); };
  // Paired as in models_of().
  for (std::size_t i = 0; i < most_of_axes(size, edges); ++i) {
    SectionEdge& edge = rules.edges.emplace_back();
    for_each_axis(
        [&](dynamics::FlexibleAxis& own, double& off, const Edges& of_axis,
            const compensate::AxisSetup& given, const dynamics::Mode& mode) {
          own = i < of_axis.size() ? of_axis[i] : given.axis;
          off = own.main_rad_s() / mode.omega_rad_s - 1.0;
        },
        edge, edge.off, edges, setup, rules);
  }
  rules.times_tolerance = kTimesAtEdge;
  return rules;
}

bool is_at_rest(const dynamics::NozzleXY& nozzle, const gcode::Position& at_mm,
                const compensate::Setup& setup) {
  constexpr double kNothing_mm = 1e-4;
  return all_axes(
      [](const dynamics::NozzleState& state, double place_mm, const compensate::AxisSetup& given) {
        const dynamics::FlexibleAxis::Gap gap = given.axis.gap(state, given.axis.riding(place_mm));
        return std::max(gap.place_mm, gap.speed_mm) <= kNothing_mm;
      },
      nozzle, xy_of(at_mm), setup);
}

// A part of the run in its new timing.
struct TimedPart {
  double begin_s = 0.0;
  std::unique_ptr<SectionMotion> motion;  // null: there is no section before the pause
  const Pause* pause = nullptr;

  [[nodiscard]] double pause_begin_s() const {
    return begin_s + (motion ? motion->duration_s() : 0.0);
  }
};

std::vector<Progress> progress_of(const Section& section, const SectionMotion& motion,
                                  double begin_s) {
  constexpr double kNothing_mm = 1e-7;
  std::vector<Progress> result;
  for (const Passage& passage : motion.passages()) {
    const Leg& leg = section.legs[passage.leg];
    const double share = passage.along_mm / leg.move.length_mm;
    const Progress at{begin_s + passage.time_s, leg.from_mm + share * (leg.to_mm - leg.from_mm)};
    if (result.empty() || at.path_mm > result.back().path_mm + kNothing_mm) {
      result.push_back(at);
    }
  }
  result.front().path_mm = section.legs.front().from_mm;
  result.back() = {begin_s + motion.duration_s(), section.legs.back().to_mm};
  for (std::size_t i = 1; i + 1 < result.size(); ++i) {
    result[i].speed_mm_s = (result[i + 1].path_mm - result[i - 1].path_mm) /
                           (result[i + 1].time_s - result[i - 1].time_s);
  }
  const auto even_mm_s = [](const Leg& leg) {
    return leg.feed_mm_s * (leg.to_mm - leg.from_mm) / leg.move.length_mm;
  };
  if (section.starts_even) {
    result.front().speed_mm_s = even_mm_s(section.legs.front());
  }
  if (section.ends_even) {
    result.back().speed_mm_s = even_mm_s(section.legs.back());
  }
  return result;
}

SectionMotion::OfAxis even(const SectionMotion::OfAxis& from, double speed_mm_s, double t) {
  return {from.position_mm + speed_mm_s * t, speed_mm_s};
}

SectionMotion::Base base_at(const std::vector<TimedPart>& parts, const gcode::Position& start_mm,
                            double t) {
  std::size_t i = 0;
  while (i + 1 < parts.size() && t >= parts[i + 1].begin_s) {
    ++i;
  }
  const TimedPart& part = parts[i];
  if (t <= 0.0 || !part.motion) {
    return map_axes([](double place_mm) { return SectionMotion::OfAxis{place_mm}; },
                    xy_of(start_mm));
  }
  if (t < part.pause_begin_s()) {
    return part.motion->base(t - part.begin_s);
  }
  const SectionMotion::Base from = part.motion->base(part.motion->duration_s());
  const double since_s = t - part.pause_begin_s();
  return map_axes([&](const SectionMotion::OfAxis& of_axis,
                      double speed_mm_s) { return even(of_axis, speed_mm_s, since_s); },
                  from, part.pause->velocity_mm_s);
}

// The smoothest motion through these places that has no speed at both ends: b̈ is linear between
// nodes. By the clamped cubic spline's equations b̈_{k−1} + 4 b̈_k + b̈_{k+1} = 6 (b_{k−1} − 2 b_k +
// b_{k+1})/h², and 2 b̈_0 + b̈_1 = 6 (b_1 − b_0)/h², and its mirror image at the end.
dynamics::AxisTrajectory through(std::vector<double> places_mm, double h) {
  const std::size_t last = places_mm.size() - 1;
  const auto chord = [&](std::size_t k) { return (places_mm[k + 1] - places_mm[k]) / h; };
  std::vector<double> accel(last + 1, 0.0);
  std::vector<double> share(last + 1, 0.0);
  share[0] = 0.5;
  accel[0] = 3.0 * chord(0) / h;
  for (std::size_t k = 1; k <= last; ++k) {
    const double own = k < last ? 4.0 : 2.0;
    const double bend = 6.0 / h * ((k < last ? chord(k) : 0.0) - chord(k - 1));
    share[k] = 1.0 / (own - share[k - 1]);
    accel[k] = share[k] * (bend - accel[k - 1]);
  }
  for (std::size_t k = last; k-- > 0;) {
    accel[k] -= share[k] * accel[k + 1];
  }
  std::vector<double> velocity(last + 1, 0.0);
  for (std::size_t k = 1; k < last; ++k) {
    velocity[k] = chord(k) - h * (2.0 * accel[k] + accel[k + 1]) / 6.0;
  }
  return {std::move(places_mm), std::move(velocity), std::move(accel)};
}

// All sections and pauses of a run.
struct Motion {
  std::vector<TimedPart> parts;
  std::vector<Progress> progress;
};

// The nozzles at the edges after a pause, in which they swing on.
std::vector<dynamics::NozzleXY> after(const Pause& pause, const SectionMotion& motion,
                                      const SectionRules& rules) {
  std::vector<dynamics::NozzleXY> nozzles = motion.edge_nozzles();
  const SectionMotion::Base base = motion.base(motion.duration_s());
  for (std::size_t i = 0; i < nozzles.size(); ++i) {
    for_each_axis(
        [&](dynamics::NozzleState& nozzle, const dynamics::FlexibleAxis& axis,
            const SectionMotion::OfAxis& from, double speed_mm_s) {
          nozzle =
              dynamics::exact_step(axis, nozzle, {from.position_mm, speed_mm_s}, pause.duration_s);
        },
        nozzles[i], rules.edges[i], base, pause.velocity_mm_s);
  }
  return nozzles;
}

// nullopt: for one of the sections nothing was found.
std::optional<Motion> fastest(std::vector<SectionedPart>& sectioned, const SectionRules& rules) {
  Motion result;
  double time_s = 0.0;
  std::vector<dynamics::NozzleXY> edge_nozzles;
  for (SectionedPart& part : sectioned) {
    TimedPart& own = result.parts.emplace_back(TimedPart{time_s, nullptr, &part.pause});
    if (!part.section.legs.empty()) {
      part.section.edge_nozzles = std::move(edge_nozzles);
      own.motion = fastest_motion(part.section, rules);
      if (!own.motion) {
        return std::nullopt;
      }
      const std::vector<Progress> progress = progress_of(part.section, *own.motion, time_s);
      result.progress.insert(result.progress.end(), progress.begin(), progress.end());
      edge_nozzles = after(part.pause, *own.motion, rules);
    }
    time_s = own.pause_begin_s() + part.pause.duration_s;
  }
  return result;
}

// The programs break their rows by a hair here and there. The limits of the base's place are hard.
double within_by_a_hair(double base_mm, const compensate::BaseLimits& limits) {
  const double nearest_mm = std::clamp(base_mm, limits.min_position_mm, limits.max_position_mm);
  return std::abs(nearest_mm - base_mm) <= Tuned::kHair_mm ? nearest_mm : base_mm;
}

dynamics::BaseTrajectory base_on(const compensate::NodeGrid& grid,
                                 const std::vector<TimedPart>& parts,
                                 const gcode::Position& start_mm, const compensate::Setup& setup) {
  Axes<std::vector<double>> places_mm;
  for (std::size_t k = 0; k < grid.count; ++k) {
    const double t = static_cast<double>(k) * grid.period_s - setup.lead_in_s;
    const SectionMotion::Base at = base_at(parts, start_mm, t);
    for_each_axis(
        [](std::vector<double>& all_mm, const auto& base, const compensate::AxisSetup& axis) {
          all_mm.push_back(within_by_a_hair(base.position_mm, axis.limits));
        },
        places_mm, at, setup);
  }
  return {
      map_axes([&](const std::vector<double>& all_mm) { return through(all_mm, grid.period_s); },
               places_mm),
      grid.period_s};
}

// The rule that the motion breaks when the base moves so; nullptr: none. A single place that is a
// little worse than in the programs is not worth another attempt.
const char* broken_by(const Timed& timed, std::span<const MoveBounds> bounds,
                      const compensate::Setup& setup, const dynamics::NozzleXY& nozzle,
                      const std::optional<Extruder>& extruder) {
  std::vector<MoveBounds> of_pieces;
  for (std::size_t i = 0; i < timed.pieces.size(); ++i) {
    of_pieces.insert(of_pieces.end(), timed.pieces[i], bounds[i]);
  }
  const std::vector<double> starts_s = planner::starts_s(timed.moves, setup.lead_in_s);
  const NozzleMeasure measured = measure(timed.moves, of_pieces, starts_s, *timed.base,
                                         models_of(setup), {}, &nozzle, extruder);
  if (std::ranges::max(measured.error) > kKept + Tuned::kMoreError ||
      std::ranges::max(measured.speed) > kKeptFeed + Tuned::kMoreSpeed ||
      std::ranges::max(measured.left) > kKept) {
    return "the nozzle would stray further than the tolerance, or run ahead of F";
  }
  return std::ranges::max(measured.width) > kKept ? "the extruder could not lay evenly enough"
                                                  : nullptr;
}

tl::expected<Timed, std::string> optimal_from(
    const FirstPlan& first, const compensate::Course& course, const compensate::Setup& setup,
    const SectionRules& rules, const dynamics::NozzleXY& nozzle, std::span<const MoveBounds> bounds,
    const std::optional<Extruder>& extruder) {
  const double slowest_rad_s =
      least_of_axes([](const dynamics::Mode& mode) { return mode.omega_rad_s; }, rules);
  auto parts = sections(course.moves, bounds, setup, Tuned::kSettling_rad / slowest_rad_s, first);
  if (!parts) {
    return tl::unexpected<std::string>("accelerations along the path are limited");
  }
  const gcode::Position& start_mm = course.moves.front().segment.start_mm;
  if (Section& section = parts->front().section;
      !section.legs.empty() && !is_at_rest(nozzle, start_mm, setup)) {
    section.nozzle = dynamics::motion(nozzle);
  }
  const std::optional<Motion> motion = fastest(*parts, rules);
  if (!motion) {
    return tl::unexpected<std::string>("no motion was found that keeps the limits");
  }
  if (motion->progress.empty()) {
    return tl::unexpected<std::string>("nothing moves in X or Y");
  }
  Timed result = timed_moves(course.moves, bounds, motion->progress);
  compensate::Course retimed = course;
  retimed.moves = result.moves;
  result.base = base_on(compensate::node_grid(retimed, setup), motion->parts, start_mm, setup);
  if (const char* const reason = broken_by(result, bounds, setup, nozzle, extruder)) {
    return tl::unexpected<std::string>(reason);
  }
  join_even(result.moves, result.pieces);
  return result;
}

}  // namespace

tl::expected<Timed, std::string> optimal(const compensate::Course& course,
                                         const compensate::Setup& setup,
                                         const dynamics::NozzleXY& nozzle,
                                         std::span<const MoveBounds> bounds,
                                         const std::optional<Extruder>& extruder) {
  const std::optional<SectionRules> rules = rules_of(setup);
  if (!rules) {
    return tl::unexpected<std::string>("the axes have several modes or plants");
  }
  if (!course.before.empty() || !course.after.empty()) {
    return tl::unexpected<std::string>("it is a part of a long motion");
  }
  std::string reason;
  for (const FirstPlan& first : kFirstPlans) {
    tl::expected<Timed, std::string> found =
        optimal_from(first, course, setup, *rules, nozzle, bounds, extruder);
    if (found) {
      return found;
    }
    reason = std::move(found.error());
  }
  return tl::unexpected(reason);
}

}  // namespace unflex::timing
