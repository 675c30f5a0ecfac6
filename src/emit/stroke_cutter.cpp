#include "stroke_cutter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "dialect.hpp"
#include "unflex/gcode/compensable.hpp"

namespace unflex::emit {
namespace {

using gcode::Z;

// Whether the line is long enough for the firmware to move at once, and not only with the next
// line.
bool goes_through(const Stroke& from, const Stroke& to, bool moves_in_z, const Grid& grid,
                  const LineRules& rules) {
  const double steps = most_of_axes(
      [](double way_mm, const AxisGrid& axis) { return std::abs(way_mm) / axis.step_mm; },
      to.place_mm - from.place_mm, grid);
  const double steps_of_z = std::abs(to.z_mm - from.z_mm) / grid.z.step_mm;
  return (moves_in_z ? std::max(steps, steps_of_z) : steps) > rules.min_steps - 0.5;
}

XY velocity_mm_s(const Stroke& from, const Stroke& to) {
  return (to.place_mm - from.place_mm) / (to.end_s - from.end_s);
}

// Whether a motor would change its speed by more than it may.
bool turns_quickly(const XY& before, const XY& after, const LineRules& rules) {
  return rules.motors.largest_of_xy(after - before) > rules.max_speed_step_mm_s;
}

// The part of its change of Z that a line can take. The line must not become steep, nor slow: Z has
// limits of its own, which a run leaves as they are. The rest waits for other lines. `before` and
// `after` are the velocities of the neighbouring lines.
double change_of_z_mm(const Stroke& from, const Stroke& to, const XY& before, const XY& after,
                      const Climb& climb, const Grid& grid, const EmitOptions& options) {
  const double length_mm = distance(from.place_mm, to.place_mm);
  const double dz = to.z_mm - from.z_mm;
  double most = climb.steepest * std::max(length_mm, grid.x.step_mm);
  if (std::abs(dz) < climb.waits_mm) {
    const double duration_s = to.end_s - from.end_s;
    const XY own = velocity_mm_s(from, to);
    // Where the path bends, a line has to slow down as if it had a ramp.
    const auto change_mm_s = [&](const XY& other) { return distance(other, own); };
    const ZLimits limits = z_limits(options.fixed, options.run_limits);
    most = std::min({most, limits.speed_mm_s * duration_s,
                     climb.ramps * limits.accel_mm_s2 * length_mm * duration_s /
                         std::max(change_mm_s(before), change_mm_s(after))});
  }
  if (std::abs(dz) <= most) {
    return dz;
  }
  return std::copysign(std::floor(most / grid.z.step_mm) * grid.z.step_mm, dz);
}

// Cuts the strokes from vertex to vertex, and merges those that would have no length.
class StrokeCutter {
 public:
  // All arguments but the last one must outlive this.
  StrokeCutter(const Timetable& table, const Polygon& vertices,
               const std::vector<double>& event_times_s, const Grid& grid, const LineRules& rules,
               const EmitOptions& options, const Stroke& from, const gcode::Position& end,
               const Passing& ends)
      : table_(table),
        vertices_(vertices),
        times_(vertices.times_s),
        event_times_s_(event_times_s),
        grid_(grid),
        rules_(rules),
        options_(options),
        end_(end),
        last_(from),
        before_(ends.in_mm_s.value_or(XY{})),
        dropped_s_(times_.front()) {}

  [[nodiscard]] BareStrokes cut() {
    for (std::size_t i = 1; i < times_.size(); ++i) {
      Stroke stroke = to_vertex(i);
      if (!is_end(i)) {
        fit_to_next(i, stroke);
      }
      take(i, stroke);
    }
    return std::move(result_);
  }

 private:
  [[nodiscard]] bool is_end(std::size_t i) const { return i + 1 == times_.size(); }

  [[nodiscard]] Stroke to_vertex(std::size_t i) {
    Stroke stroke;
    stroke.end_s = times_[i] - dropped_s_;
    stroke.place_mm = is_end(i) ? xy_of(end_) : vertices_.place_mm(i);
    stroke.z_mm = is_end(i) ? end_[Z] : grid_.z.nearest(table_.height_mm(times_[i]));
    // An event goes before the stroke that begins nearest to its moment.
    while (event_ < event_times_s_.size() &&
           event_times_s_[event_] <= times_[i] - 0.5 * rules_.min_line_s) {
      ++event_;
    }
    stroke.events = event_;
    return stroke;
  }

  // Gives the stroke a length where the base turns round, and leaves a change of Z that the stroke
  // cannot take to the next one.
  void fit_to_next(std::size_t i, Stroke& stroke) const {
    const Stroke next{times_[i + 1] - dropped_s_, vertices_.place_mm(i + 1)};
    if (!grid_.x.is_coarse() && !result_.strokes.empty() &&
        !goes_through(last_, stroke, table_.moves_in_z(), grid_, rules_) &&
        turns_quickly(before_, velocity_mm_s(last_, next), rules_)) {
      // The base rests here while it turns round. A line without a length would become part of the
      // next one.
      give_length(next, grid_, rules_, stroke);
    }
    stroke.z_mm = last_.z_mm + change_of_z_mm(last_, stroke, before_, velocity_mm_s(stroke, next),
                                              climb_of(table_.moves_in_z()), grid_, options_);
  }

  // Adds the stroke, if it has a length. Otherwise it becomes part of the next one, or is dropped
  // at the start of the run.
  void take(std::size_t i, const Stroke& stroke) {
    if (goes_through(last_, stroke, table_.moves_in_z(), grid_, rules_)) {
      before_ = velocity_mm_s(last_, stroke);
      result_.laying +=
          result_.laying == result_.strokes.size() && !table_.tail_at(times_[i - 1]) ? 1 : 0;
      result_.strokes.push_back(stroke);
      result_.ends_s.push_back(times_[i]);
      last_ = stroke;
    } else if (result_.strokes.empty()) {
      dropped_s_ += times_[i] - times_[i - 1];
    }
  }

  const Timetable& table_;
  const Polygon& vertices_;
  const std::vector<double>& times_;
  const std::vector<double>& event_times_s_;
  const Grid& grid_;
  const LineRules& rules_;
  const EmitOptions& options_;
  const gcode::Position& end_;
  Stroke last_;
  XY before_;         // velocity of the last stroke
  double dropped_s_;  // when the first stroke begins
  std::size_t event_ = 0;
  BareStrokes result_;
};

}  // namespace

Climb climb_of(bool moves_in_z) {
  // A base that moves in Z to make up for modes does so at corners, too, where X and Y are slow.
  return moves_in_z ? Climb{1.0, 0.25, std::numeric_limits<double>::infinity()}
                    : Climb{2.0 * gcode::kMaxSlope, 0.03, 0.01};
}

BareStrokes cut_strokes(const Timetable& table, const Polygon& vertices,
                        const std::vector<double>& event_times_s, const Grid& grid,
                        const LineRules& rules, const EmitOptions& options, const Stroke& from,
                        const gcode::Position& end, const Passing& ends) {
  return StrokeCutter(table, vertices, event_times_s, grid, rules, options, from, end, ends).cut();
}

void climb_in_time(const Stroke& start, XY after, const Climb& climb, const Grid& grid,
                   const EmitOptions& options, std::vector<Stroke>& strokes) {
  for (std::size_t i = strokes.size(); i-- > 1;) {
    const XY before = velocity_mm_s(i > 1 ? strokes[i - 2] : start, strokes[i - 1]);
    const double change_mm =
        change_of_z_mm(strokes[i - 1], strokes[i], before, after, climb, grid, options);
    const double left_mm = strokes[i].z_mm - strokes[i - 1].z_mm - change_mm;
    if (left_mm == 0.0) {
      return;
    }
    strokes[i - 1].z_mm += left_mm;
    after = velocity_mm_s(strokes[i - 1], strokes[i]);
  }
}

}  // namespace unflex::emit
