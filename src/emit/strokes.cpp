#include "strokes.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "line_ends.hpp"
#include "unflex/core/number.hpp"
#include "unflex/gcode/compensable.hpp"
#include "vertices.hpp"

namespace unflex::emit {
namespace {

using gcode::E;
using gcode::Z;
using planner::PlannedMove;

// A move boundary must be a vertex when filament per mm changes there by so much that a typical
// line (2 ms) laid across it would give either move more than this too much or too little.
constexpr double kFilamentStepMm = 1e-5;
constexpr double kTypicalLineS = 2e-3;

// The run's moves in time, and the filament and height that belong to a moment.
class Timetable {
 public:
  explicit Timetable(const Run& run) : run_(&run) {
    double t = run.lead_in_s;
    for (const PlannedMove& move : *run.moves) {
      starts_s_.push_back(t);
      t += move.duration_s();
    }
    starts_s_.push_back(t);
    const dynamics::BaseTrajectory& base = *run.base;
    travelled_mm_.push_back(0.0);
    for (std::size_t k = 1; k < base.nodes(); ++k) {
      travelled_mm_.push_back(travelled_mm_.back() +
                              std::hypot(base.x.position_mm[k] - base.x.position_mm[k - 1],
                                         base.y.position_mm[k] - base.y.position_mm[k - 1]));
    }
  }

  // Start of move i; i may be the number of moves.
  [[nodiscard]] double start_s(std::size_t i) const { return starts_s_[i]; }
  [[nodiscard]] std::size_t moves() const { return run_->moves->size(); }

  // The move at time t.
  [[nodiscard]] std::size_t move_at(double t) const {
    const auto after = std::upper_bound(starts_s_.begin(), starts_s_.end() - 1, t);
    return after == starts_s_.begin() ? 0 : static_cast<std::size_t>(after - starts_s_.begin()) - 1;
  }

  // E or Z at time t: each move's share of it is spread along the base's path while the move lasts,
  // which keeps filament per mm constant where the firmware looks for jumps in it, and the slope
  // small where the base is slower than the plan.
  [[nodiscard]] double along_path_mm(double t, gcode::Axis axis) const {
    if (t >= starts_s_.back()) {
      return run_->moves->back().segment.end_mm[axis];
    }
    if (t <= starts_s_.front()) {
      return run_->moves->front().segment.start_mm[axis];
    }
    const std::size_t i = move_at(t);
    const PlannedMove& move = (*run_->moves)[i];
    const double from = travelled_mm(starts_s_[i]);
    const double length = travelled_mm(starts_s_[i + 1]) - from;
    const double share =
        length > 0.0 ? (travelled_mm(t) - from) / length : (t - starts_s_[i]) / move.duration_s();
    return move.segment.start_mm[axis] + share * move.segment.delta(axis);
  }

  // Filament since the start of the run.
  [[nodiscard]] double filament_mm(double t) const {
    return along_path_mm(t, E) - run_->moves->front().segment.start_mm[E];
  }

  // Of move i, along the base's path.
  [[nodiscard]] double filament_per_mm(std::size_t i) const {
    const double length = travelled_mm(starts_s_[i + 1]) - travelled_mm(starts_s_[i]);
    return length > 0.0 ? (*run_->moves)[i].segment.delta(E) / length : 0.0;
  }

 private:
  [[nodiscard]] double travelled_mm(double t) const {
    const double h = run_->base->period_s;
    const double at = std::clamp(t / h, 0.0, static_cast<double>(travelled_mm_.size() - 1));
    const auto k = std::min(static_cast<std::size_t>(at), travelled_mm_.size() - 2);
    return travelled_mm_[k] +
           (at - static_cast<double>(k)) * (travelled_mm_[k + 1] - travelled_mm_[k]);
  }

  const Run* run_;
  std::vector<double> starts_s_;      // of each move, and the end of the last
  std::vector<double> travelled_mm_;  // length of the base's path at the nodes
};

// Whether the boundary before move i has to be a vertex for the sake of the filament.
bool filament_changes(const Run& run, const Timetable& table, std::size_t i) {
  const double t = table.start_s(i);
  const double speed = std::hypot(run.base->x_at(t).velocity_mm_s, run.base->y_at(t).velocity_mm_s);
  const double jump = std::abs(table.filament_per_mm(i) - table.filament_per_mm(i - 1));
  return jump * std::max(speed, 1.0) * kTypicalLineS / 4.0 > kFilamentStepMm;
}

// For each event the time it stands at: the end of the moves before it.
std::vector<double> event_times(const Run& run, const Timetable& table) {
  std::vector<double> times;
  std::size_t move = 0;
  for (const std::size_t count : *run.move_counts) {
    times.push_back(table.start_s(move));
    move += count;
  }
  return times;
}

// Moments at which a line must end: the ends of the run, lines that stand between moves, changes of
// filament per mm. Closer ones than the shortest line allows fall together.
std::vector<double> required_times(const Run& run, const Timetable& table,
                                   const std::vector<double>& event_time_s, double min_line_s) {
  std::vector<double> wanted;
  for (std::size_t i = 0; i < event_time_s.size(); ++i) {
    if ((*run.events)[i].kind != gcode::EventKind::move) {
      wanted.push_back(event_time_s[i]);
    }
  }
  for (std::size_t i = 1; i < table.moves(); ++i) {
    if (filament_changes(run, table, i)) {
      wanted.push_back(table.start_s(i));
    }
  }
  wanted.push_back(table.start_s(0));
  wanted.push_back(table.start_s(table.moves()));
  std::ranges::sort(wanted);
  const double end = run.base->duration_s();
  std::vector<double> times = {0.0};
  for (const double t : wanted) {
    if (t - times.back() >= min_line_s && end - t >= min_line_s) {
      times.push_back(t);
    }
  }
  times.push_back(end);
  return times;
}

double snap(double value_mm, double offset_mm, int decimals) {
  return offset_mm +
         static_cast<double>(to_scaled(value_mm - offset_mm, decimals)) / power_of_ten(decimals);
}

// Digits of F in mm/min that keep a line's duration within 0.05 %.
int speed_decimals(double feed_mm_min) {
  if (feed_mm_min >= 1000.0) {
    return 0;
  }
  if (feed_mm_min >= 100.0) {
    return 1;
  }
  return feed_mm_min >= 1.0 ? 3 : 9;
}

// Distances and accelerations of the strokes, and their speeds: from the rounded distances and the
// times, with the time the firmware's ramps cost,
//   v = (d + ((v − v_prev)₊² + (v − v_next)₊²) / 2A) / T
// A line as fast as or slower than its neighbours has no ramp.
class SpeedSolver {
 public:
  SpeedSolver(const Run& run, const EmitOptions& options, double speed_factor,
              std::vector<Stroke>& strokes)
      : strokes_(&strokes),
        mm_s_per_feed_(speed_factor / 60.0),
        distance_mm_(strokes.size()),
        accel_mm_s2_(strokes.size(), options.run_limits.max_accel_mm_s2),
        speed_mm_s_(strokes.size()) {
    gcode::Position at = run.moves->front().segment.start_mm;
    for (std::size_t i = 0; i < strokes.size(); ++i) {
      const Stroke& stroke = strokes[i];
      const double dz = stroke.z_mm - at[Z];
      distance_mm_[i] = std::hypot(stroke.x_mm - at[gcode::X], stroke.y_mm - at[gcode::Y], dz);
      if (dz != 0.0) {
        accel_mm_s2_[i] = std::min(
            accel_mm_s2_[i], options.fixed.max_z_accel_mm_s2 * distance_mm_[i] / std::abs(dz));
      }
      at = {stroke.x_mm, stroke.y_mm, stroke.z_mm, 0.0};
    }
  }

  void solve() {
    // The ramps are short against the lines, so a few rounds over the neighbours settle them.
    constexpr int kRounds = 6;
    std::vector<double> next(strokes_->size());
    for (int round = 0; round <= kRounds; ++round) {
      double start_s = 0.0;
      for (std::size_t i = 0; i < next.size(); ++i) {
        const double end_s = (*strokes_)[i].end_s;
        next[i] = (distance_mm_[i] + (round > 0 ? ramps_mm(i) : 0.0)) / (end_s - start_s);
        start_s = end_s;
      }
      speed_mm_s_.swap(next);
    }
    // Last, rounded as F will be; what that does to the clock the next line makes up for.
    double clock_s = 0.0;
    for (std::size_t i = 0; i < speed_mm_s_.size(); ++i) {
      const double due_s = (*strokes_)[i].end_s - clock_s;
      const double feed = (distance_mm_[i] + ramps_mm(i)) / due_s / mm_s_per_feed_;
      const int decimals = speed_decimals(feed);
      (*strokes_)[i].feed_decimals = decimals;
      speed_mm_s_[i] = (*strokes_)[i].speed_mm_s =
          static_cast<double>(std::max<std::int64_t>(to_scaled(feed, decimals), 1)) /
          power_of_ten(decimals) * mm_s_per_feed_;
      clock_s += (distance_mm_[i] + ramps_mm(i)) / speed_mm_s_[i];
    }
  }

 private:
  // What the ramps of stroke i cost, as distance at its speed.
  [[nodiscard]] double ramps_mm(std::size_t i) const {
    const double v = speed_mm_s_[i];
    const double up = std::max(v - (i > 0 ? speed_mm_s_[i - 1] : 0.0), 0.0);
    const double down = std::max(v - (i + 1 < speed_mm_s_.size() ? speed_mm_s_[i + 1] : 0.0), 0.0);
    return (up * up + down * down) / (2.0 * accel_mm_s2_[i]);
  }

  std::vector<Stroke>* strokes_;
  double mm_s_per_feed_;
  std::vector<double> distance_mm_;
  std::vector<double> accel_mm_s2_;
  std::vector<double> speed_mm_s_;
};

}  // namespace

std::vector<Stroke> strokes(const Run& run, const Grid& grid, const EmitOptions& options) {
  const Timetable table(run);
  const dynamics::BaseTrajectory& base = *run.base;
  const std::vector<double> event_time_s = event_times(run, table);
  LineRules rules = options.lines;
  rules.tolerance_mm *= run.tolerance_share;
  const std::vector<double> required = required_times(run, table, event_time_s, rules.min_line_s);
  std::vector<double> times = {0.0};
  for (std::size_t i = 1; i < required.size(); ++i) {
    append_line_ends(base, required[i - 1], required[i], rules, times);
  }
  const double step_mm = 1.0 / power_of_ten(grid.decimals);
  const VertexChooser along_x(base, &dynamics::BaseTrajectory::x_at, rules.nozzle_x);
  const VertexChooser along_y(base, &dynamics::BaseTrajectory::y_at, rules.nozzle_y);
  AxisVertices x;
  AxisVertices y;
  do {
    x = along_x.choose(times, {grid.x_offset_mm, step_mm}, rules.reach_x, rules.max_accel_mm_s2);
    y = along_y.choose(times, {grid.y_offset_mm, step_mm}, rules.reach_y, rules.max_accel_mm_s2);
  } while (split_lines(base, x.nozzle_error_mm, y.nozzle_error_mm, rules, times));
  const gcode::Position start = run.moves->front().segment.start_mm;
  const gcode::Position end = run.moves->back().segment.end_mm;
  std::vector<Stroke> result;
  Stroke last{0.0, start[gcode::X], start[gcode::Y], start[gcode::Z]};
  double dropped_s = 0.0;
  std::size_t event = 0;
  for (std::size_t i = 1; i < times.size(); ++i) {
    Stroke stroke;
    stroke.end_s = times[i] - dropped_s;
    const bool is_end = i + 1 == times.size();
    stroke.x_mm = is_end ? end[gcode::X] : snap(x.position_mm[i], grid.x_offset_mm, grid.decimals);
    stroke.y_mm = is_end ? end[gcode::Y] : snap(y.position_mm[i], grid.y_offset_mm, grid.decimals);
    stroke.z_mm = is_end ? end[gcode::Z]
                         : snap(table.along_path_mm(times[i], Z), grid.z_offset_mm, grid.decimals);
    stroke.e_mm = table.filament_mm(times[i]);
    // An event goes before the stroke that begins nearest to its moment.
    while (event < event_time_s.size() &&
           event_time_s[event] <= times[i] - 0.5 * rules.min_line_s) {
      ++event;
    }
    stroke.events = event;
    const double length = std::hypot(stroke.x_mm - last.x_mm, stroke.y_mm - last.y_mm);
    if (!is_end && std::abs(stroke.z_mm - last.z_mm) > 2.0 * gcode::kMaxSlope * length) {
      stroke.z_mm = last.z_mm;  // a rounding step of Z waits for a line that is not steep by it
    }
    if (length > 0.5 / power_of_ten(grid.decimals)) {
      result.push_back(stroke);
      last = stroke;
    } else if (result.empty()) {
      dropped_s += times[i] - times[i - 1];
    }
  }
  if (!result.empty()) {
    Stroke& final = result.back();
    final.e_mm = table.filament_mm(times.back());
    final.x_mm = end[gcode::X];
    final.y_mm = end[gcode::Y];
    final.z_mm = end[gcode::Z];
    SpeedSolver(run, options, grid.speed_factor, result).solve();
  }
  return result;
}

}  // namespace unflex::emit
