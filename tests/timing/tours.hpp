// Tours of corners, sections of a few legs, and what a nozzle makes of a base along them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

#include "../compensate/playback.hpp"
#include "sections.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing::testing {

using Moves = std::vector<planner::PlannedMove>;

inline constexpr double kTolerance_mm = 20e-3;
// What the motors of these tests do.
inline constexpr double kMotors_mm_s2 = 20000.0;

inline compensate::Setup setup() {
  compensate::Setup result =
      compensate::testing::setup_for(dynamics::from_frequency(45.0, 0.06), kMotors_mm_s2);
  result.end_weight = 10.0;
  return result;
}

inline std::vector<MoveBounds> bounds_of(const Moves& moves) {
  std::vector<MoveBounds> bounds;
  for (const planner::PlannedMove& move : moves) {
    bounds.push_back({.speed_mm_s = move.segment.feed_mm_s, .tolerance_mm = kTolerance_mm});
  }
  return bounds;
}

// A tour of corners of all angles, some close together, at a constant F.
inline Moves tour(unsigned seed, double feed_mm_s, bool travels = false) {
  constexpr std::size_t kCorners = 12;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(0.0, 15.0);
  std::uniform_real_distribution<double> near(-0.5, 0.5);
  std::vector<compensate::testing::Point> points = {{5.0, 5.0}};
  for (std::size_t i = 0; i < kCorners; ++i) {
    points.push_back(i % 3 == 2 ? compensate::testing::Point{points.back().x_mm + near(random),
                                                             points.back().y_mm + near(random)}
                                : compensate::testing::Point{place(random), place(random),
                                                             !travels || i % 4 != 3});
  }
  return compensate::testing::plan(points,
                                   compensate::testing::planner_limits(feed_mm_s, 2000.0, 5.0));
}

// What a nozzle does on a base along its moves.
struct Drawn {
  double duration_s = 0.0;
  double largest_error_mm = 0.0;       // nearest to a move that lays filament
  double error_while_laying_mm = 0.0;  // by the timing of the moves
  double largest_travel_mm = 0.0;      // at any time
  double fastest = 0.0;                // relative to F, likewise
  double swing_mm = 0.0;               // in the end
  double accel_mm_s2 = 0.0;            // of the base
  double base_mm_s = 0.0;              // its largest speed
};

inline double distance_mm(const planner::PlannedMove& move, double x_mm, double y_mm) {
  const double px = x_mm - move.segment.start_mm[gcode::X];
  const double py = y_mm - move.segment.start_mm[gcode::Y];
  const double along = std::clamp(px * move.direction[gcode::X] + py * move.direction[gcode::Y],
                                  0.0, move.length_mm);
  return std::hypot(px - along * move.direction[gcode::X], py - along * move.direction[gcode::Y]);
}

inline Drawn played(const Moves& moves, const dynamics::BaseTrajectory& base,
                    const dynamics::FlexibleAxis& axis) {
  Drawn drawn;
  drawn.duration_s = planner::duration_s(moves);
  for (const dynamics::AxisTrajectory* own : {&base.x, &base.y}) {
    for (const double accel : own->accel_mm_s2) {
      drawn.accel_mm_s2 = std::max(drawn.accel_mm_s2, std::abs(accel));
    }
  }
  for (std::size_t k = 0; k < base.nodes(); ++k) {
    drawn.base_mm_s =
        std::max(drawn.base_mm_s, std::hypot(base.x.velocity_mm_s[k], base.y.velocity_mm_s[k]));
  }
  const auto nozzle_x =
      compensate::testing::play(axis, base.x, base.period_s, compensate::testing::at_rest(moves).x);
  const auto nozzle_y =
      compensate::testing::play(axis, base.y, base.period_s, compensate::testing::at_rest(moves).y);
  constexpr double kReach_s = 31e-3;
  for (std::size_t i = 0; i < nozzle_x.size(); ++i) {
    const double t = static_cast<double>(i) * base.period_s / compensate::testing::kSubsteps;
    double least_mm = std::numeric_limits<double>::infinity();
    const planner::PlannedMove* on = nullptr;
    const planner::PlannedMove* timed = nullptr;
    double start_s = 0.0;
    for (const planner::PlannedMove& move : moves) {
      if (start_s - kReach_s <= t && t <= start_s + move.duration_s() + kReach_s) {
        const double away_mm = distance_mm(move, nozzle_x[i].position(), nozzle_y[i].position());
        if (away_mm < least_mm) {
          least_mm = away_mm;
          on = &move;
        }
      }
      if (start_s <= t) {
        timed = &move;
      }
      start_s += move.duration_s();
    }
    if (timed->segment.extruding()) {
      drawn.error_while_laying_mm = std::max(drawn.error_while_laying_mm, least_mm);
    }
    drawn.largest_travel_mm = std::max(drawn.largest_travel_mm, least_mm);
    if (on != nullptr && on->segment.extruding()) {
      drawn.largest_error_mm = std::max(drawn.largest_error_mm, least_mm);
      drawn.fastest =
          std::max(drawn.fastest, std::hypot(nozzle_x[i].velocity(), nozzle_y[i].velocity()) /
                                      on->segment.feed_mm_s);
    }
  }
  const gcode::Position& end = moves.back().segment.end_mm;
  const auto gap_x = axis.gap(nozzle_x.back(), axis.riding(end[gcode::X]));
  const auto gap_y = axis.gap(nozzle_y.back(), axis.riding(end[gcode::Y]));
  drawn.swing_mm =
      std::hypot(gap_x.place_mm, gap_x.speed_mm, std::hypot(gap_y.place_mm, gap_y.speed_mm));
  return drawn;
}

// On the base that is found for the moves.
inline Drawn draw(const Moves& moves, const compensate::Setup& of,
                  const dynamics::FlexibleAxis& axis) {
  const std::vector<compensate::WindowSpan> spans = mesh(moves, node_grid(moves, of), of);
  std::vector<compensate::RunWindow> windows =
      compensate::windows(moves, spans, compensate::testing::at_rest(moves), of);
  const auto engine = compensate::make_banded_engine();
  return played(moves, *compensate::solve_all(*engine, spans, windows), axis);
}

// A move in Z alone, as a planner has it between two others.
inline planner::PlannedMove lift(const gcode::Position& from, double length_mm) {
  planner::PlannedMove move;
  move.segment.start_mm = move.segment.end_mm = from;
  move.segment.end_mm[gcode::Z] += length_mm;
  move.segment.feed_mm_s = 10.0;
  move.length_mm = length_mm;
  move.direction[gcode::Z] = 1.0;
  return move;
}

inline constexpr MoveBounds kLiftBounds = {.speed_mm_s = 10.0, .accel_mm_s2 = 100.0};

// A path through these points as one section, from rest to rest.
inline Section section_along(const std::vector<compensate::testing::Point>& points,
                             double feed_mm_s) {
  // Longer than any leg is even.
  constexpr double kNeverSettles_s = 100.0;
  const Moves moves = compensate::testing::plan(
      points, compensate::testing::planner_limits(feed_mm_s, 2000.0, 5.0));
  return sections(moves, bounds_of(moves), setup(), kNeverSettles_s)->front().section;
}

}  // namespace unflex::timing::testing
