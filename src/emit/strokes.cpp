#include "strokes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "dialect.hpp"
#include "filament.hpp"
#include "line_ends.hpp"
#include "nozzle_progress.hpp"
#include "speeds.hpp"
#include "step_path.hpp"
#include "stroke_cutter.hpp"
#include "timetable.hpp"
#include "unflex/core/math.hpp"
#include "unflex/core/number.hpp"
#include "unflex/gcode/compensable.hpp"

namespace unflex::emit {
namespace {

using gcode::Z;

// Moments at which a line should end, in order: where other lines stand between moves, where
// filament per mm changes, and where the motion begins and ends.
std::vector<double> wanted_times(const Run& run, const Timetable& table,
                                 const std::vector<double>& event_times_s,
                                 const NozzleProgress& nozzle, bool has_free_timing) {
  std::vector<double> wanted;
  for (std::size_t i = 0; i < event_times_s.size(); ++i) {
    if ((*run.events)[i].kind != gcode::EventKind::move) {
      wanted.push_back(event_times_s[i]);
    }
  }
  for (std::size_t i = 1; i < table.moves(); ++i) {
    if (table.filament_changes(i)) {
      // Where the timing is free, the nozzle may pass some ms earlier or later than the plan.
      wanted.push_back(has_free_timing ? nozzle.begin_s(i) : table.start_s(i));
    }
  }
  wanted.push_back(table.start_s(0));
  wanted.push_back(table.start_s(table.moves()));
  std::ranges::sort(wanted);
  return wanted;
}

// The wanted times at which a line can end, and the ends of the run. A wanted time is left out if
// the lines before or behind it would be too short, or so long that speed changes too much from one
// to the next.
std::vector<double> required_times(const Run& run, const std::vector<double>& wanted,
                                   const LineRules& rules) {
  const double end = run.end_s();
  const auto has_lines = [&](double from, double to) {
    return long_enough(*run.base, from, to, rules) && cuts_well(*run.base, from, to, rules);
  };
  std::vector<double> times = {0.0};
  for (const double t : wanted) {
    if (has_lines(times.back(), t) && has_lines(t, end)) {
      times.push_back(t);
    }
  }
  times.push_back(end);
  return times;
}

// The place to which the file's own moves take the machine. The firmware may round it.
gcode::Position end_of_moves(const Run& run) {
  for (auto event = run.events->rbegin(); event != run.events->rend(); ++event) {
    if (!event->segments.empty()) {
      return event->segments.back().end_mm;
    }
  }
  return run.moves->back().segment.end_mm;
}

// Whether the firmware has skipped the run's last move, as Marlin does with one of a few steps. It
// makes that way with its next move.
bool skips_last_move(const Run& run, const Grid& grid) {
  constexpr double kRounding = 1.25;  // steps
  const gcode::Position end = end_of_moves(run);
  const gcode::Position& machine = run.moves->back().segment.end_mm;
  return !run.until_s &&
         any_axis([](double way_mm,
                     const AxisGrid& axis) { return std::abs(way_mm) > kRounding * axis.step_mm; },
                  xy_of(end) - xy_of(machine), grid);
}

// The place to which the run's lines take the machine.
gcode::Position end_of_lines(const Run& run, const Timetable& table, const Grid& grid) {
  gcode::Position end =
      skips_last_move(run, grid) ? run.moves->back().segment.end_mm : end_of_moves(run);
  if (run.until_s) {
    set_xy(end, nearest(grid, run.base->position_mm(*run.until_s)));
    end[Z] = grid.z.nearest(table.height_mm(*run.until_s));
  }
  return end;
}

// The file's position when the run begins. Marlin may be behind this position by the filament of a
// move that was too short for it.
gcode::Position start_of(const Run& run) {
  for (const gcode::Event& event : *run.events) {
    if (!event.segments.empty()) {
      return event.segments.front().start_mm;
    }
  }
  return run.moves->front().segment.start_mm;
}

gcode::Position start_position(const Run& run, const Timetable& table, const Grid& grid) {
  gcode::Position start = run.moves->front().segment.start_mm;
  set_xy(start, start_of_lines(run, grid));
  if (run.goes_on && run.base->above) {
    start[Z] = grid.z.nearest(table.height_mm(0.0));
  }
  return start;
}

// Whether t is near a sharp corner, or near the end of the run, beyond which the path does not go
// on.
bool is_at_corner(const Run& run, const Timetable& table, std::size_t move, double t) {
  constexpr double kReach_s = 8e-3;
  const std::vector<planner::PlannedMove>& moves = *run.moves;
  const auto turns_behind = [&](std::size_t i) {
    return i + 1 < moves.size() ? planner::turns_sharply(moves[i].direction, moves[i + 1].direction)
                                : !run.until_s;
  };
  return (t < table.start_s(move) + kReach_s && move > 0 && turns_behind(move - 1)) ||
         (t > table.start_s(move + 1) - kReach_s && turns_behind(move));
}

// Errors across a drawn path count most. Errors along the path only shift time, except at a sharp
// corner and at the path's end, where they lead off the path. Where nothing is drawn, errors matter
// only by their effect on later motion.
ErrorWeight error_weight(const Run& run, const Timetable& table, double t) {
  constexpr double kAlong = 0.001;
  constexpr double kAlongAtCorner = 0.03;
  constexpr double kTravel = 0.02;
  constexpr double kBehindEnd = 0.3;
  const std::size_t move = table.move_at(t);
  const gcode::Segment& segment = (*run.moves)[move].segment;
  if (!segment.extruding()) {
    return {kTravel, 0.0, kTravel};
  }
  if (t > table.start_s(table.moves())) {
    return {kBehindEnd, 0.0, kBehindEnd};
  }
  const double length = segment.length_xy_mm();
  const auto [nx, ny] = turned_left(segment.way_xy_mm()) / length;
  const double along = is_at_corner(run, table, move, t) ? kAlongAtCorner : kAlong;
  const double across = 1.0 - along;
  return {along + across * nx * nx, across * nx * ny, along + across * ny * ny};
}

// The largest changes of speed of each axis. If motors move both axes, each axis gets what the base
// itself needs where lines join, and half of what is left to the motors.
Axes<SpeedSteps> speed_steps(const dynamics::BaseTrajectory& base, const std::vector<double>& times,
                             const Ends& ends, const LineRules& rules) {
  const double most_mm_s = kOfSpeedStep * rules.max_speed_step_mm_s;
  const double gain = rules.motors.gain_of_xy();
  Axes<SpeedSteps> steps = on_all_axes(SpeedSteps{most_mm_s / gain, rules.max_accel_mm_s2 / gain});
  if (!rules.motors.shared_by_xy()) {
    return steps;
  }
  const auto velocity = [&](double t, bool rests) { return rests ? XY{} : base.velocity_mm_s(t); };
  XY before = velocity(0.0, ends.from_rest);
  double before_s = 0.0;
  const auto add_join = [&](const XY& after, double after_s) {
    const XY change_mm_s = map_axes([](double change) { return std::abs(change); }, after - before);
    const double both = std::min(most_mm_s, rules.max_accel_mm_s2 * 0.5 * (before_s + after_s));
    // Motors do x + y or x − y, whatever the signs of the two changes.
    const double of_motors = std::max(rules.motors.largest_of_xy(change_mm_s),
                                      rules.motors.largest_of_xy({change_mm_s.x, -change_mm_s.y}));
    const double left = std::max(both - of_motors, 0.0) / rules.motors.gain_of_both();
    for_each_axis([&](SpeedSteps& axis, double change) { axis.at_mm_s.push_back(change + left); },
                  steps, change_mm_s);
    before = after;
    before_s = after_s;
  };
  for (std::size_t k = 0; k + 1 < times.size(); ++k) {
    const double duration_s = times[k + 1] - times[k];
    add_join((base.position_mm(times[k + 1]) - base.position_mm(times[k])) / duration_s,
             duration_s);
  }
  add_join(velocity(times.back(), ends.to_rest), 0.0);
  return steps;
}

// Halves lines where the filament cannot change its speed as fast as the hotend asks. Returns
// whether any line was halved.
bool split_for_filament(const Run& run, const NozzleProgress& nozzle,
                        const Axes<AxisVertices>& vertices, const LineRules& rules,
                        const EmitOptions& options, std::vector<double>& times) {
  if (!writes_pressure(nozzle, options)) {
    return false;
  }
  LinesInTime lines{times, {}};
  for (std::size_t i = 1; i < times.size(); ++i) {
    lines.lengths_mm.push_back(length(map_axes(
        [&](const AxisVertices& axis) { return axis.position_mm[i] - axis.position_mm[i - 1]; },
        vertices)));
  }
  return split_at_joins(*run.base, joins_at_limit(nozzle, lines, options), rules, times);
}

Polygon polygon(const Run& run, const Timetable& table, const NozzleProgress& nozzle,
                const std::vector<double>& wanted, const Grid& grid, const LineRules& rules,
                const EmitOptions& options) {
  const dynamics::BaseTrajectory& base = *run.base;
  if (any_axis([](const AxisGrid& axis) { return axis.is_coarse(); }, grid)) {
    return step_path(
        base, wanted, [&](double t) { return error_weight(run, table, t); },
        {start_of_lines(run, grid), xy_of(end_of_lines(run, table, grid)), run.lines_before_s,
         run.lines_after, run.goes_on, run.until_s},
        grid, rules);
  }
  const std::vector<double> required = required_times(run, wanted, rules);
  std::vector<double> times = {0.0};
  for (std::size_t i = 1; i < required.size(); ++i) {
    append_line_ends(base, required[i - 1], required[i], rules, times);
  }
  const VertexChooser x(base, 0, rules.nozzle.x);
  const VertexChooser y(base, 1, rules.nozzle.y);
  const Axes<const VertexChooser*> choosers{&x, &y};
  const auto choose = [&] {
    const Ends ends{!run.goes_on, !run.until_s};
    return map_axes(
        [&](const VertexChooser* chooser, const AxisGrid& axis, const Reach& reach,
            const SpeedSteps& steps) { return chooser->choose(times, axis, reach, steps, ends); },
        choosers, grid, rules.reach, speed_steps(base, times, ends, rules));
  };
  Axes<AxisVertices> vertices = choose();
  while (split_lines(base, vertices, rules, times) ||
         split_quick_joins(base, vertices, rules, times) ||
         split_for_filament(run, nozzle, vertices, rules, options, times)) {
    vertices = choose();
  }
  return {std::move(times),
          map_axes([](const AxisVertices& axis) { return axis.position_mm; }, vertices)};
}

// The velocity with which a part of a run begins and ends.
Passing passing(const Run& run) {
  const auto velocity = [&](double t) {
    constexpr double kMoves_mm_s = 0.1;
    const XY v = run.base->velocity_mm_s(t);
    return length(v) > kMoves_mm_s ? std::optional(v) : std::nullopt;
  };
  Passing result;
  result.kept_before = run.kept_before;
  if (run.goes_on) {
    result.in_mm_s = velocity(0.0);
  }
  if (run.until_s) {
    result.out_mm_s = velocity(*run.until_s);
  }
  return result;
}

// What the base's motion in Z asks of a motor of X or Y. Lines are cut for X and Y, so this much
// acceleration is kept for Z.
double accel_for_z_mm_s2(const Run& run, const LineRules& rules) {
  double most = 0.0;
  if (run.base->above) {
    for (const double accel : run.base->above->accel_mm_s2) {
      most = std::max(most, rules.motors.largest_of_xy({}, accel));
    }
  }
  return std::min(most, 0.5 * rules.max_accel_mm_s2);
}

LineRules rules_for(const Run& run, const EmitOptions& options) {
  LineRules rules = options.lines;
  // Lines are cut for each axis by itself. Where Z swings with X, the error that a line causes on
  // one axis shows on the other, too.
  constexpr double kWhereZSwings = 0.5;
  rules.tolerance_mm *= run.tolerance_share * (run.base->above ? kWhereZSwings : 1.0);
  rules.burst_lines = static_cast<int>(run.limits_share * rules.burst_lines);
  rules.max_accel_mm_s2 = run.limits_share * rules.max_accel_mm_s2 - accel_for_z_mm_s2(run, rules);
  return rules;
}

// The text ends where the file does, by a line that the firmware skips as it skips the file's last
// move.
Stroke skipped_stroke(const Run& run, double file_start_e_mm, const Stroke& last) {
  const gcode::Position file_end = end_of_moves(run);
  Stroke rest = last;
  rest.place_mm = xy_of(file_end);
  rest.z_mm = file_end[Z];
  rest.e_mm = file_end[gcode::E] - file_start_e_mm;
  rest.is_skipped = true;
  return rest;
}

}  // namespace

XY start_of_lines(const Run& run, const Grid& grid) {
  if (!run.goes_on) {
    return xy_of(run.moves->front().segment.start_mm);
  }
  return run.from_mm.value_or(nearest(grid, run.base->position_mm(0.0)));
}

void give_length(const Stroke& next, const Grid& grid, const LineRules& rules, Stroke& stroke) {
  const XY way_mm = next.place_mm - stroke.place_mm;
  const std::size_t axis = std::abs(way_mm.y) > std::abs(way_mm.x) ? 1 : 0;
  const Reach& reach = rules.reach[axis];
  double& at_mm = stroke.place_mm[axis];
  const double shift_mm = std::copysign(rules.min_steps * grid[axis].step_mm, way_mm[axis]);
  const double ahead_mm = at_mm + shift_mm;
  const bool within = ahead_mm >= reach.min_mm && ahead_mm <= reach.max_mm;
  at_mm = within ? ahead_mm : at_mm - shift_mm;
}

std::vector<Stroke> strokes(const Run& run, const Grid& grid, const EmitOptions& options) {
  const Timetable table(run);
  const std::vector<double> event_times_s = table.event_times_s();
  const LineRules rules = rules_for(run, options);
  const NozzleProgress nozzle(run, table.starts_s(), rules.nozzle, rules.field);
  const Polygon vertices = polygon(
      run, table, nozzle, wanted_times(run, table, event_times_s, nozzle, options.has_free_timing),
      grid, rules, options);
  if (vertices.times_s.empty()) {
    return {};
  }
  const gcode::Position start = start_position(run, table, grid);
  const gcode::Position end = end_of_lines(run, table, grid);
  const Stroke from{0.0, xy_of(start), start[Z]};
  const Passing ends = passing(run);
  BareStrokes bare =
      cut_strokes(table, vertices, event_times_s, grid, rules, options, from, end, ends);
  std::vector<Stroke>& result = bare.strokes;
  if (result.empty()) {
    return {};
  }
  result.back().place_mm = xy_of(end);
  result.back().z_mm = end[Z];
  climb_in_time(from, ends.out_mm_s.value_or(XY{}), climb_of(table.moves_in_z()), grid, options,
                result);
  const double file_start_e_mm = start_of(run)[gcode::E];
  const RunFilament filament{end[gcode::E] - file_start_e_mm, file_start_e_mm - start[gcode::E]};
  lay_filament(run, table, nozzle, filament, start, bare.ends_s, bare.laying, options, result);
  if (skips_last_move(run, grid)) {
    result.push_back(skipped_stroke(run, file_start_e_mm, result.back()));
  }
  time_strokes(run, grid, options, result);
  return std::move(bare.strokes);
}

void time_strokes(const Run& run, const Grid& grid, const EmitOptions& options,
                  std::vector<Stroke>& strokes) {
  // A stroke that the firmware skips takes no time.
  std::optional<Stroke> skipped;
  if (!strokes.empty() && strokes.back().is_skipped) {
    skipped = strokes.back();
    strokes.pop_back();
  }
  set_speeds(start_position(run, Timetable(run), grid), passing(run), options, grid, run.late_s,
             strokes);
  if (skipped) {
    skipped->speed_mm_s = strokes.back().speed_mm_s;
    skipped->feed_decimals = strokes.back().feed_decimals;
    strokes.push_back(*skipped);
  }
}

}  // namespace unflex::emit
