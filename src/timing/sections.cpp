#include "sections.hpp"

#include <algorithm>
#include <cmath>

#include "bounded_plan.hpp"
#include "corner_speed.hpp"
#include "tunings.hpp"
#include "unflex/core/xy.hpp"

namespace unflex::timing {
namespace {

using Tuned = OptimalTunings;

double flat_share(const planner::PlannedMove& move) { return length(xy_of(move.direction)); }

// From one place to another, in X and Y alone.
planner::PlannedMove straight(const gcode::Position& from, const gcode::Position& to) {
  planner::PlannedMove move;
  move.length_mm = distance(xy_of(from), xy_of(to));
  set_xy(move.segment.start_mm, xy_of(from));
  set_xy(move.segment.end_mm, xy_of(to));
  set_xy(move.direction, move.segment.way_xy_mm() / move.length_mm);
  return move;
}

Leg leg_of(const planner::PlannedMove& move, const MoveBounds& bounds, double travel_tolerance_mm) {
  Leg leg;
  leg.move = straight(move.segment.start_mm, move.segment.end_mm);
  leg.lays_filament = move.segment.extruding();
  leg.feed_mm_s = bounds.speed_mm_s;
  if (leg.lays_filament) {
    leg.feed_mm_s = std::min({leg.feed_mm_s, move.segment.feed_mm_s, bounds.nozzle_speed_mm_s});
  }
  leg.feed_mm_s *= flat_share(move);
  leg.tolerance_mm =
      leg.lays_filament ? std::min(bounds.tolerance_mm, kTravelTolerance_mm) : travel_tolerance_mm;
  leg.entry_mm_s = bounds.start_speed_mm_s * flat_share(move);
  return leg;
}

bool are_alike(const Leg& a, const Leg& b) {
  return a.lays_filament == b.lays_filament && have_same_feed(a, b) &&
         a.tolerance_mm == b.tolerance_mm && !std::isfinite(b.entry_mm_s);
}

// Neighbours that lie on one line become one leg.
std::vector<Leg> joined(const std::vector<Leg>& legs) {
  std::vector<Leg> result;
  for (std::size_t i = 0; i < legs.size();) {
    Leg leg = legs[i];
    std::size_t next = i + 1;
    for (; next < legs.size() && next - i < Tuned::kMostMovesOfLeg && are_alike(leg, legs[next]);
         ++next) {
      if (dot(xy_of(leg.move.direction), xy_of(legs[next].move.direction)) <= 0.0) {
        break;
      }
      const planner::PlannedMove longer =
          straight(leg.move.segment.start_mm, legs[next].move.segment.end_mm);
      double bulge_mm = 0.0;
      for (std::size_t part = i; part < next; ++part) {
        bulge_mm = std::max(bulge_mm, distance_mm(longer, xy_of(legs[part].move.segment.end_mm)));
      }
      if (bulge_mm > std::min(Tuned::kStraight_mm, Tuned::kStraightShare * leg.tolerance_mm)) {
        break;
      }
      leg.move = longer;
      leg.bulge_mm = bulge_mm;
      leg.to_mm = legs[next].to_mm;
    }
    result.push_back(leg);
    i = next;
  }
  return result;
}

// A first plan, with corners on circles.
void plan(std::vector<Leg>& legs, const compensate::Setup& setup, double accel_share) {
  const double accel_mm_s2 = accel_share * setup.x.limits.max_accel_mm_s2;
  std::vector<planner::PlannedMove> path;
  std::vector<MoveBounds> bounds;
  std::vector<double> vertex_mm_s = {0.0};
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const planner::PlannedMove& move = path.emplace_back(legs[i].move);
    const double of_motors = asked_of_motors(xy_of(move.direction), setup.shares_motors);
    bounds.push_back({.speed_mm_s = legs[i].feed_mm_s, .accel_mm_s2 = accel_mm_s2 / of_motors});
    if (i + 1 < legs.size()) {
      const double speed_mm_s =
          corner_speed_mm_s(move, legs[i + 1].move, accel_mm_s2,
                            std::min(legs[i].tolerance_mm, legs[i + 1].tolerance_mm));
      vertex_mm_s.push_back(
          std::min(std::max(speed_mm_s, Tuned::kLeastSpeed_mm_s), legs[i + 1].entry_mm_s));
    }
  }
  vertex_mm_s.push_back(0.0);
  path = bounded_plan(path, bounds, vertex_mm_s);
  for (std::size_t i = 0; i < legs.size(); ++i) {
    legs[i].move = path[i];
  }
}

// The leg from one moment of the first plan to another.
Leg part_of(const Leg& leg, double from_s, double to_s) {
  Leg part = leg;
  part.move = straight(leg.move.position_mm(from_s), leg.move.position_mm(to_s));
  part.move.start_v_mm_s = leg.move.velocity_mm_s(from_s);
  part.move.end_v_mm_s = leg.move.velocity_mm_s(to_s);
  part.move.cruise_v_mm_s = leg.move.cruise_v_mm_s;
  part.move.accel_mm_s2 = leg.move.accel_mm_s2;
  part.move.accel_s = std::max(leg.move.accel_s - from_s, 0.0);
  part.move.decel_s = std::max(to_s - (leg.move.duration_s() - leg.move.decel_s), 0.0);
  part.move.cruise_s = to_s - from_s - part.move.accel_s - part.move.decel_s;
  const double per_mm = (leg.to_mm - leg.from_mm) / leg.move.length_mm;
  part.from_mm = leg.from_mm + per_mm * leg.move.distance_mm(from_s);
  part.to_mm = leg.from_mm + per_mm * leg.move.distance_mm(to_s);
  return part;
}

// Cuts the legs between two moments of rest where they are even for long.
void cut(const std::vector<Leg>& legs, double settling_s, std::vector<SectionedPart>& parts) {
  SectionedPart part;
  for (const Leg& leg : legs) {
    const double from_s = leg.move.accel_s + settling_s;
    const double end_s = leg.move.duration_s();
    const double to_s = end_s - leg.move.decel_s - settling_s;
    if (to_s - from_s < Tuned::kShortestPause_s) {
      part.section.legs.push_back(leg);
      continue;
    }
    part.section.legs.push_back(part_of(leg, 0.0, from_s));
    part.section.ends_even = true;
    part.pause = {to_s - from_s, leg.move.cruise_v_mm_s * xy_of(leg.move.direction)};
    parts.push_back(std::move(part));
    part = {};
    part.section.starts_even = true;
    part.section.legs.push_back(part_of(leg, to_s, end_s));
    part.section.legs.back().entry_mm_s = planner::kNoLimit;
  }
  parts.push_back(std::move(part));
}

}  // namespace

bool have_same_feed(const Leg& a, const Leg& b) {
  constexpr double kNothing = 1e-6;
  return a.feed_mm_s == b.feed_mm_s ||
         std::abs(a.feed_mm_s - b.feed_mm_s) <= kNothing * std::min(a.feed_mm_s, b.feed_mm_s);
}

bool is_upright(const planner::PlannedMove& move) {
  constexpr double kNothing_mm = 1e-9;
  return move.length_mm * flat_share(move) < kNothing_mm;
}

planner::PlannedMove from_rest_to_rest(const planner::PlannedMove& move, const MoveBounds& bounds) {
  const double at_rest[] = {0.0, 0.0};
  return bounded_plan({&move, 1}, {&bounds, 1}, at_rest).front();
}

std::optional<std::vector<SectionedPart>> sections(std::span<const planner::PlannedMove> path,
                                                   std::span<const MoveBounds> bounds,
                                                   const compensate::Setup& setup,
                                                   double settling_s, const FirstPlan& first) {
  // Only a limit below this many times the acceleration of the base counts as one along the path.
  constexpr double kTimesBase = 2.0;
  std::vector<SectionedPart> parts;
  std::vector<Leg> legs;
  double path_mm = 0.0;
  const auto rest = [&](double duration_s) {
    if (!legs.empty()) {
      legs = joined(legs);
      plan(legs, setup, first.accel_share);
      cut(legs, settling_s, parts);
      legs.clear();
    } else if (parts.empty()) {
      parts.emplace_back();
    }
    parts.back().pause.duration_s += duration_s;
  };
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (is_upright(path[i])) {
      rest(from_rest_to_rest(path[i], bounds[i]).duration_s());
      continue;
    }
    if (bounds[i].accel_mm_s2 < kTimesBase * setup.x.limits.max_accel_mm_s2) {
      return std::nullopt;
    }
    Leg& leg = legs.emplace_back(leg_of(path[i], bounds[i], first.travel_tolerance_mm));
    leg.from_mm = path_mm;
    path_mm += leg.move.length_mm;
    leg.to_mm = path_mm;
    if (i > 0) {
      leg.entry_mm_s =
          std::min(leg.entry_mm_s, bounds[i - 1].end_speed_mm_s * flat_share(path[i - 1]));
    }
  }
  rest(0.0);
  parts.back().section.swing_tolerance_mm = bounds.back().tolerance_mm;
  return parts;
}

}  // namespace unflex::timing
