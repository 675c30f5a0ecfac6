#include "filament.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

#include "filament_flow.hpp"
#include "pressure_program.hpp"
#include "smoothed_filament.hpp"
#include "unflex/core/math.hpp"

namespace unflex::emit {
namespace {

using gcode::X;
using gcode::Y;

// V(t) where E = V: once the moves have ended it is all of their filament, since a tail lays none.
double laid_mm(const NozzleProgress& nozzle, const Timetable& table, const RunFilament& filament,
               double t) {
  if (table.tail_at(t)) {
    return filament.all_mm;
  }
  const double behind_mm = filament.behind_mm;
  const double filament_mm = nozzle.filament_mm(t);
  if (nozzle.past_first_move(t)) {
    return filament_mm - behind_mm;
  }
  return filament_mm - std::clamp(filament_mm, std::min(behind_mm, 0.0), std::max(behind_mm, 0.0));
}

LinesInTime lines_in_time(const gcode::Position& start_mm, const std::vector<double>& ends_s,
                          const std::vector<Stroke>& strokes) {
  LinesInTime result;
  result.times_s.push_back(ends_s.front() - strokes.front().end_s);
  Stroke before{.place_mm = xy_of(start_mm)};
  for (std::size_t i = 0; i < strokes.size(); ++i) {
    result.times_s.push_back(ends_s[i]);
    result.lengths_mm.push_back(distance(before.place_mm, strokes[i].place_mm));
    before = strokes[i];
  }
  return result;
}

// The smooth time with which Klipper's extruder can follow a step Δ of the flow where lines join.
// The step takes K Δ more filament, which is pushed by a parabola up and one down. A smooth time
// shorter than lines gains nothing.
double smooth_time_s(double advance_s, double most_mm_s2) {
  constexpr double kStep_mm_s = 0.8;  // Δ
  constexpr double kLeast_s = 0.008;
  constexpr double kSteps_per_s = 1e4;
  const double smooth_s = 2.0 * std::sqrt(advance_s * kStep_mm_s / most_mm_s2);
  return std::max(kLeast_s, std::ceil(smooth_s * kSteps_per_s) / kSteps_per_s);
}

// The lines push what the nozzle lays.
void lay_as_the_nozzle_goes(const NozzleProgress& nozzle, const Timetable& table,
                            const RunFilament& filament, const gcode::Position& start_mm,
                            const std::vector<double>& ends_s, std::size_t laying,
                            const EmitOptions& options, std::vector<Stroke>& strokes) {
  const double ahead_s = options.run_advance ? options.pressure.hotend.dead_time_s : 0.0;
  const auto laid_by = [&](double t) { return laid_mm(nozzle, table, filament, t + ahead_s); };
  const double smooth_s = options.run_advance ? options.run_advance->smooth_s : 0.0;
  if (smooth_s > 0.0) {
    const std::vector<double> e_mm =
        filament_to_smooth(lines_in_time(start_mm, ends_s, strokes),
                           {.advance_s = options.run_advance->advance_s,
                            .smooth_s = smooth_s,
                            .most_step_mm_s = most_flow_step_mm_s(options.fixed),
                            .most_accel_mm_s2 = options.pressure.max_accel_mm_s2},
                           laid_by);
    for (std::size_t i = 0; i < strokes.size(); ++i) {
      strokes[i].e_mm = e_mm[i + 1];
    }
  } else {
    for (std::size_t i = 0; i < strokes.size(); ++i) {
      strokes[i].e_mm = laid_by(ends_s[i]);
    }
  }
  strokes.back().e_mm = filament.all_mm;
  level_flow(start_mm, most_flow_step_mm_s(options.fixed), std::span(strokes).first(laying));
}

// Where lines are slow, neighbouring errors cancel within the width of a nozzle. So no line counts
// as shorter than this.
constexpr double kShortest_mm = 0.03;

// The lines of the problem, without limits.
std::vector<PressureLine> wanted_lines(const NozzleProgress& nozzle, const LinesInTime& in_time,
                                       const dynamics::HotendPressure& hotend) {
  const std::size_t count = in_time.lengths_mm.size();
  std::vector<PressureLine> lines(count);
  std::vector<double> ways_mm(count);
  double laid_mm = 0.0;
  double way_mm = nozzle.way_mm(in_time.times_s.front() + hotend.dead_time_s);
  double drawn_mm = 0.0;
  double drawn_way_mm = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    PressureLine& line = lines[i];
    line.duration_s = in_time.times_s[i + 1] - in_time.times_s[i];
    line.length_mm = in_time.lengths_mm[i];
    const double until_s = in_time.times_s[i + 1] + hotend.dead_time_s;
    const double until_mm = i + 1 == count ? nozzle.all_laid_mm() : nozzle.laid_mm(until_s);
    line.wanted_mm = until_mm - laid_mm;
    laid_mm = until_mm;
    ways_mm[i] = nozzle.way_mm(until_s) - way_mm;
    way_mm += ways_mm[i];
    if (line.wanted_mm > 0.0) {
      drawn_mm += line.wanted_mm;
      drawn_way_mm += ways_mm[i];
    }
    const double flow_mm_s = line.wanted_mm / line.duration_s;
    line.slope_s = hotend.slope_s(flow_mm_s);
    line.rest_mm = hotend.pressed_mm(flow_mm_s) - line.slope_s * flow_mm_s;
  }
  // Errors count relative to the filament that a place asks for. Where a place asks for none, they
  // count relative to the mean.
  const double mean_mm = drawn_way_mm > 0.0 ? drawn_mm / drawn_way_mm : 1.0;
  for (std::size_t i = 0; i < count; ++i) {
    constexpr double kNoWay_mm = 1e-6;
    const bool draws = lines[i].wanted_mm > 0.0 && ways_mm[i] > kNoWay_mm;
    const double per_mm = draws ? lines[i].wanted_mm / ways_mm[i] : mean_mm;
    lines[i].weight = 1.0 / (per_mm * per_mm * std::max(ways_mm[i], kShortest_mm));
  }
  return lines;
}

// The least that line i may push, mm: below 0, what it may draw back. Klipper accelerates a line
// that draws back slowly, and its ramps must not take more than a share of its time.
double least_mm(const std::vector<PressureLine>& lines, std::size_t i,
                const planner::FirmwareConfig& firmware) {
  constexpr double kRamps = 0.3;  // share of a line's time
  const double speed_mm_s = lines[i].speed_mm_s();
  double change_mm_s = 0.0;
  if (i > 0) {
    change_mm_s = std::abs(speed_mm_s - lines[i - 1].speed_mm_s());
  }
  if (i + 1 < lines.size()) {
    change_mm_s = std::max(change_mm_s, std::abs(lines[i + 1].speed_mm_s() - speed_mm_s));
  }
  const double accel_mm_s2 = std::max(change_mm_s / (kRamps * lines[i].duration_s), 1.0);
  return -lines[i].length_mm * drawing_back_mm_s2(firmware) / accel_mm_s2;
}

std::vector<PressureLine> lines_of(const NozzleProgress& nozzle, const LinesInTime& in_time,
                                   const EmitOptions& options) {
  std::vector<PressureLine> lines = wanted_lines(nozzle, in_time, options.pressure.hotend);
  // Rounding may add a little to what the firmware takes of filament on a line.
  constexpr double kOfMost = 0.98;
  const double step_mm_s = most_flow_step_mm_s(options.fixed);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const double next_s = lines[std::min(i + 1, lines.size() - 1)].duration_s;
    lines[i].most_step_mm_s = std::min(
        step_mm_s, options.pressure.max_accel_mm_s2 * 0.5 * (lines[i].duration_s + next_s));
    const gcode::InterpreterOptions& takes = options.interpreter;
    lines[i].most_mm =
        kOfMost * std::max(takes.max_extrude_dab_mm, takes.max_extrude_ratio * lines[i].length_mm);
    lines[i].least_mm = std::max(least_mm(lines, i, options.fixed), -lines[i].most_mm);
  }
  return lines;
}

PressureEnds ends_of(const NozzleProgress& nozzle, const EmitOptions& options) {
  const dynamics::HotendPressure& hotend = options.pressure.hotend;
  return {hotend.pressed_mm(nozzle.flow_begin_mm_s()), hotend.pressed_mm(nozzle.flow_end_mm_s())};
}

// The lines push what has to be pushed for V to come out of the hotend.
void write_pressure(const Run& run, const NozzleProgress& nozzle, const RunFilament& filament,
                    const gcode::Position& start_mm, const std::vector<double>& ends_s,
                    const EmitOptions& options, std::vector<Stroke>& strokes) {
  const LinesInTime in_time = lines_in_time(start_mm, ends_s, strokes);
  const PressureEnds ends = ends_of(nozzle, options);
  const std::vector<double> pushed = pushed_filament(lines_of(nozzle, in_time, options), ends);
  double e_mm = ends.begin_mm;
  for (std::size_t i = 0; i < strokes.size(); ++i) {
    e_mm += pushed[i];
    strokes[i].e_mm = e_mm + nozzle.drawn_back_mm(ends_s[i]) - filament.behind_mm;
  }
  if (!run.until_s) {
    strokes.back().e_mm = filament.all_mm;
  }
}

}  // namespace

dynamics::HotendPressure hotend_of(const EmitOptions& options,
                                   const gcode::PressureAdvance& of_file) {
  dynamics::HotendPressure hotend = options.pressure.hotend;
  if (hotend.advance_s == 0.0) {
    hotend.advance_s = planner::advance_in_force(options.fixed, of_file).advance_s;
  }
  return hotend;
}

std::optional<planner::FirmwareAdvance> advance_in_run(const EmitOptions& options,
                                                       const gcode::PressureAdvance& of_file) {
  const dynamics::HotendPressure hotend = hotend_of(options, of_file);
  if (!options.pressure.is_written || hotend.advance_s == 0.0) {
    return std::nullopt;
  }
  if (!options.pressure.printer_presses) {
    return planner::FirmwareAdvance{};
  }
  return planner::FirmwareAdvance{
      hotend.advance_s,
      std::min(smooth_time_s(hotend.advance_s, options.pressure.max_accel_mm_s2),
               of_file.smooth_s.value_or(options.fixed.pressure_advance_smooth_s))};
}

bool writes_pressure(const NozzleProgress& nozzle, const EmitOptions& options) {
  return options.run_advance && options.run_advance->advance_s == 0.0 && nozzle.all_laid_mm() > 0.0;
}

std::vector<bool> joins_at_limit(const NozzleProgress& nozzle, const LinesInTime& in_time,
                                 const EmitOptions& options) {
  constexpr double kAtLimit = 0.95;
  const std::vector<PressureLine> lines = lines_of(nozzle, in_time, options);
  const std::vector<double> pushed = pushed_filament(lines, ends_of(nozzle, options));
  std::vector<bool> result(lines.size(), false);
  for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
    const PressureLine& a = lines[i];
    const PressureLine& b = lines[i + 1];
    const double v_mm_s = std::min(a.speed_mm_s(), b.speed_mm_s());
    const double step_mm_s = v_mm_s * (pushed[i + 1] / b.length_mm - pushed[i] / a.length_mm);
    // Shorter lines help where the firmware limits a join or the filament per mm. They do not help
    // against the extruder's acceleration, which allows less change in less time.
    result[i] = std::abs(step_mm_s) > kAtLimit * most_flow_step_mm_s(options.fixed) ||
                std::max(pushed[i] / a.most_mm, pushed[i + 1] / b.most_mm) > kAtLimit;
  }
  return result;
}

void lay_filament(const Run& run, const Timetable& table, const NozzleProgress& nozzle,
                  const RunFilament& filament, const gcode::Position& start_mm,
                  const std::vector<double>& ends_s, std::size_t laying, const EmitOptions& options,
                  std::vector<Stroke>& strokes) {
  if (writes_pressure(nozzle, options)) {
    write_pressure(run, nozzle, filament, start_mm, ends_s, options, strokes);
  } else {
    lay_as_the_nozzle_goes(nozzle, table, filament, start_mm, ends_s, laying, options, strokes);
  }
}

}  // namespace unflex::emit
