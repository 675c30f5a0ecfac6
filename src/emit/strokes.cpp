#include "strokes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "dialect.hpp"
#include "filament.hpp"
#include "line_ends.hpp"
#include "nozzle_progress.hpp"
#include "speeds.hpp"
#include "step_path.hpp"
#include "timetable.hpp"
#include "unflex/core/math.hpp"
#include "unflex/core/number.hpp"
#include "unflex/gcode/compensable.hpp"

namespace unflex::emit {
namespace {

using gcode::Z;

// On a grid this coarse, rounding is what limits accuracy.
constexpr double kCoarse_mm = 1e-3;

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

// Where the file's own moves take the machine. The firmware may round that place.
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

// Where the run's lines take the machine.
gcode::Position end_of_lines(const Run& run, const Timetable& table, const Grid& grid) {
  gcode::Position end =
      skips_last_move(run, grid) ? run.moves->back().segment.end_mm : end_of_moves(run);
  if (run.until_s) {
    set_xy(end, nearest(grid, run.base->position_mm(*run.until_s)));
    end[Z] = grid.z.nearest(table.height_mm(*run.until_s));
  }
  return end;
}

// Where the file is when the run begins. Marlin may be behind by the filament of a move that was
// too short for it.
gcode::Position start_of(const Run& run) {
  for (const gcode::Event& event : *run.events) {
    if (!event.segments.empty()) {
      return event.segments.front().start_mm;
    }
  }
  return run.moves->front().segment.start_mm;
}

gcode::Position start_position(const Run& run, const Grid& grid) {
  gcode::Position start = run.moves->front().segment.start_mm;
  set_xy(start, start_of_lines(run, grid));
  return start;
}

// Whether the line is long enough for the firmware to move at once, and not only with the next
// line.
bool goes_through(const Stroke& from, const Stroke& to, const Grid& grid, const LineRules& rules) {
  const double steps = most_of_axes(
      [](double way_mm, const AxisGrid& axis) { return std::abs(way_mm) / axis.step_mm; },
      to.place_mm - from.place_mm, grid);
  return steps > rules.min_steps - 0.5;
}

XY velocity_mm_s(const Stroke& from, const Stroke& to) {
  return (to.place_mm - from.place_mm) / (to.end_s - from.end_s);
}

// Whether a motor would change its speed by more than it may.
bool turns_quickly(const XY& before, const XY& after, const LineRules& rules) {
  return rules.motors.largest_of_xy(after - before) > rules.max_speed_step_mm_s;
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

// Across a drawn path errors count most; along it they only shift time, though at a sharp corner
// they lead off the path, and so does each error behind its end. Where nothing is drawn, errors
// matter only by what they leave behind for later.
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
  Axes<SpeedSteps> steps = on_all_axes(SpeedSteps{most_mm_s, rules.max_accel_mm_s2});
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
    const double left = std::max(both - of_motors, 0.0);
    for_each_axis(
        [&](SpeedSteps& axis, double change) { axis.at_mm_s.push_back(change + 0.5 * left); },
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
  if (any_axis([](const AxisGrid& axis) { return axis.step_mm > kCoarse_mm; }, grid)) {
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

// How much of its change of Z a line can take. The line must not become steep, nor slow: Z has
// limits of its own, which a run leaves as they are. The rest waits for other lines, as long as it
// is too small to be seen. `before` and `after` are the velocities of the neighbouring lines.
double change_of_z_mm(const Stroke& from, const Stroke& to, const XY& before, const XY& after,
                      const Grid& grid, const EmitOptions& options) {
  constexpr double kUnseen_mm = 0.01;
  // Share of the line's time that ramps may take. F makes up for them, so F changes more than the
  // speed does.
  constexpr double kRamps = 0.03;
  const double length_mm = distance(from.place_mm, to.place_mm);
  const double dz = to.z_mm - from.z_mm;
  double most = 2.0 * gcode::kMaxSlope * length_mm;
  if (std::abs(dz) < kUnseen_mm) {
    const double duration_s = to.end_s - from.end_s;
    const XY own = velocity_mm_s(from, to);
    // Where the path bends, a line has to slow down as if it had a ramp.
    const auto change_mm_s = [&](const XY& other) { return distance(other, own); };
    const ZLimits limits = z_limits(options.fixed, options.run_limits);
    most = std::min({most, limits.speed_mm_s * duration_s,
                     kRamps * limits.accel_mm_s2 * length_mm * duration_s /
                         std::max(change_mm_s(before), change_mm_s(after))});
  }
  if (std::abs(dz) <= most) {
    return dz;
  }
  return std::copysign(std::floor(most / grid.z.step_mm) * grid.z.step_mm, dz);
}

// The run must end at its height. What the last line cannot take of the change of Z, the lines
// before it take. `after`: the velocity behind the last line.
void climb_in_time(const Stroke& start, XY after, const Grid& grid, const EmitOptions& options,
                   std::vector<Stroke>& strokes) {
  for (std::size_t i = strokes.size(); i-- > 1;) {
    const XY before = velocity_mm_s(i > 1 ? strokes[i - 2] : start, strokes[i - 1]);
    const double change_mm =
        change_of_z_mm(strokes[i - 1], strokes[i], before, after, grid, options);
    const double left_mm = strokes[i].z_mm - strokes[i - 1].z_mm - change_mm;
    if (left_mm == 0.0) {
      return;
    }
    strokes[i - 1].z_mm += left_mm;
    after = velocity_mm_s(strokes[i - 1], strokes[i]);
  }
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
  LineRules rules = options.lines;
  rules.tolerance_mm *= run.tolerance_share;
  rules.burst_lines = static_cast<int>(run.limits_share * rules.burst_lines);
  rules.max_accel_mm_s2 *= run.limits_share;
  const NozzleProgress nozzle(run, table.starts_s(), rules.nozzle);
  const Polygon vertices = polygon(
      run, table, nozzle, wanted_times(run, table, event_times_s, nozzle, options.has_free_timing),
      grid, rules, options);
  const std::vector<double>& times = vertices.times_s;
  if (times.empty()) {
    return {};
  }
  const gcode::Position start = start_position(run, grid);
  const gcode::Position end = end_of_lines(run, table, grid);
  std::vector<Stroke> result;
  const double file_start_e_mm = start_of(run)[gcode::E];
  const RunFilament filament{end[gcode::E] - file_start_e_mm, file_start_e_mm - start[gcode::E]};
  std::vector<double> ends_s;  // of the strokes
  std::size_t laying = 0;  // lines that lay the run's filament; lines of the tail come after them
  Stroke last{0.0, xy_of(start), start[Z]};
  double dropped_s = times.front();
  std::size_t event = 0;
  const Passing ends = passing(run);
  XY before = ends.in_mm_s.value_or(XY{});
  for (std::size_t i = 1; i < times.size(); ++i) {
    Stroke stroke;
    stroke.end_s = times[i] - dropped_s;
    const bool is_end = i + 1 == times.size();
    stroke.place_mm = is_end ? xy_of(end) : vertices.place_mm(i);
    stroke.z_mm = is_end ? end[Z] : grid.z.nearest(table.height_mm(times[i]));
    // An event goes before the stroke that begins nearest to its moment.
    while (event < event_times_s.size() &&
           event_times_s[event] <= times[i] - 0.5 * rules.min_line_s) {
      ++event;
    }
    stroke.events = event;
    if (!is_end) {
      const Stroke next{times[i + 1] - dropped_s, vertices.place_mm(i + 1)};
      if (grid.x.step_mm <= kCoarse_mm && !result.empty() &&
          !goes_through(last, stroke, grid, rules) &&
          turns_quickly(before, velocity_mm_s(last, next), rules)) {
        // The base rests here while it turns round. A line without a length would become part of
        // the next one.
        give_length(next, grid, rules, stroke);
      }
      stroke.z_mm = last.z_mm + change_of_z_mm(last, stroke, before, velocity_mm_s(stroke, next),
                                               grid, options);
    }
    if (goes_through(last, stroke, grid, rules)) {
      before = velocity_mm_s(last, stroke);
      laying += laying == result.size() && !table.tail_at(times[i - 1]) ? 1 : 0;
      result.push_back(stroke);
      ends_s.push_back(times[i]);
      last = stroke;
    } else if (result.empty()) {
      dropped_s += times[i] - times[i - 1];
    }
  }
  if (!result.empty()) {
    Stroke& final = result.back();
    final.place_mm = xy_of(end);
    final.z_mm = end[Z];
    climb_in_time({0.0, xy_of(start), start[Z]}, ends.out_mm_s.value_or(XY{}), grid, options,
                  result);
    lay_filament(run, table, nozzle, filament, start, ends_s, laying, options, result);
    if (skips_last_move(run, grid)) {
      // The text ends where the file does, by a line that the firmware skips as well.
      const gcode::Position file_end = end_of_moves(run);
      Stroke rest = result.back();
      rest.place_mm = xy_of(file_end);
      rest.z_mm = file_end[Z];
      rest.e_mm = file_end[gcode::E] - file_start_e_mm;
      rest.is_skipped = true;
      result.push_back(rest);
    }
    time_strokes(run, grid, options, result);
  }
  return result;
}

void time_strokes(const Run& run, const Grid& grid, const EmitOptions& options,
                  std::vector<Stroke>& strokes) {
  // What the firmware skips takes no time.
  std::optional<Stroke> skipped;
  if (!strokes.empty() && strokes.back().is_skipped) {
    skipped = strokes.back();
    strokes.pop_back();
  }
  set_speeds(start_position(run, grid), passing(run), options, grid, run.late_s, strokes);
  if (skipped) {
    skipped->speed_mm_s = strokes.back().speed_mm_s;
    skipped->feed_decimals = strokes.back().feed_decimals;
    strokes.push_back(*skipped);
  }
}

}  // namespace unflex::emit
