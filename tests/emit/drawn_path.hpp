// Planned moves, and the output lines for a base that follows them.
#pragma once

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "plain_base.hpp"
#include "strokes.hpp"
#include "unflex/planner/klipper_planner.hpp"

namespace unflex::emit::testing {

// Moves with their plan, and the events that belong to them.
struct Path {
  explicit Path(const std::vector<gcode::Position>& points, double feed_mm_s = 60.0) {
    planner::KlipperPlanner planner({}, {});
    for (std::size_t i = 1; i < points.size(); ++i) {
      planner.add({points[i - 1], points[i], feed_mm_s, i, true});
      gcode::Event event;
      event.kind = gcode::EventKind::move;
      events.push_back(event);
      move_counts.push_back(1);
    }
    planner.stop();
    planner.take(moves);
  }

  // Inserts a line without motion before event i.
  void insert(std::size_t i, gcode::EventKind kind) {
    gcode::Event event;
    event.kind = kind;
    events.insert(events.begin() + static_cast<std::ptrdiff_t>(i), event);
    move_counts.insert(move_counts.begin() + static_cast<std::ptrdiff_t>(i), 0);
  }

  [[nodiscard]] std::vector<Stroke> draw(const dynamics::BaseTrajectory& base,
                                         const EmitOptions& how = options(),
                                         double lead_in_s = 0.0) const {
    return strokes({&events, &move_counts, &moves, &base, lead_in_s}, {}, how);
  }

  std::vector<gcode::Event> events;
  std::vector<std::size_t> move_counts;
  std::vector<planner::PlannedMove> moves;
};

inline Path random_path(unsigned seed, std::size_t count) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> step(-4.0, 4.0);
  std::uniform_real_distribution<double> filament(0.0, 0.2);
  std::vector<gcode::Position> points = {{100.0, 100.0, 0.2, 3.0}};
  while (points.size() <= count) {
    gcode::Position next = points.back();
    // Rounded to 10⁻³ mm, as slicers do.
    next[gcode::X] = std::round((next[gcode::X] + step(random)) * 1e3) / 1e3;
    next[gcode::Y] = std::round((next[gcode::Y] + step(random)) * 1e3) / 1e3;
    next[gcode::E] += std::round(filament(random) * 1e5) / 1e5;
    points.push_back(next);
  }
  return Path(points);
}

}  // namespace unflex::emit::testing
