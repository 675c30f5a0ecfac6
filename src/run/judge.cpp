#include "unflex/run/judge.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <utility>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/run/nozzle_motion.hpp"

namespace unflex::run {
namespace {

// No print shows a difference below these.
constexpr double kNothingRms_mm = 0.5e-3;
constexpr double kNothing_mm = 3e-3;
// The share of an error that coarse time steps may miss.
constexpr double kSampling = 2e-4;

}  // namespace

verify::RunDeviation deviation_of(const Piece& run,
                                  const std::vector<planner::PlannedMove>& reference_moves,
                                  const std::vector<planner::PlannedMove>& base,
                                  const dynamics::NozzleXY& nozzle, const verify::Rules& rules,
                                  double lead_in_s) {
  const verify::NozzleModel model = verify::coarse(rules.nozzle);
  if (run.begins_run() && run.ends_run()) {
    return verify::measure(reference_moves, base, nozzle, model, rules.change, lead_in_s);
  }
  // The base may be a little ahead of the plan or behind it, so the reference includes the moves
  // around the part.
  std::vector<planner::PlannedMove> reference = run.before;
  reference.insert(reference.end(), reference_moves.begin(), reference_moves.end());
  reference.insert(reference.end(), run.after.begin(), run.after.end());
  return verify::measure(reference, base, nozzle, model, rules.change,
                         lead_in_s - planner::duration_s(run.before), !run.ends_run());
}

verify::RunDeviation deviation_as_sliced(const Piece& run, const dynamics::NozzleXY& nozzle,
                                         const verify::Rules& rules) {
  std::vector<planner::PlannedMove> played;
  std::ranges::transform(run.moves, std::back_inserter(played), planner::as_played);
  return deviation_of(run, played, played, nozzle, rules, 0.0);
}

namespace {

constexpr std::size_t kNoLine = std::numeric_limits<std::size_t>::max();

// A line that continues the last one for a while, since the printer goes on after it.
gcode::Segment continued(const gcode::Segment& last) {
  constexpr double kAWhile_s = 0.05;
  gcode::Segment line = last;
  line.start_mm = last.end_mm;
  const double lengths = kAWhile_s * last.feed_mm_s / last.length_mm();
  for (const gcode::Axis axis : gcode::kXYZE) {
    line.end_mm[axis] += lengths * last.delta(axis);
  }
  if (line.reading_of_e) {
    gcode::ReadingOfE& reading = *line.reading_of_e;
    const float ended = reading.end;
    reading.end += static_cast<float>(lengths) * (reading.end - reading.start);
    reading.start = ended;
  }
  line.line = kNoLine;
  return line;
}

// The text as the printer would carry it out.
struct Replayed {
  std::optional<planner::PlannedMove>
      before;  // the last move before the text, if it is a later part
  std::vector<planner::PlannedMove> moves;
};

// Marlin skips a move of a few steps and makes it with the next one, so it is not where the text
// says. Returns the skipped move, if there is one.
std::optional<gcode::Segment> left_to_next(const gcode::Position& machine_mm,
                                           const gcode::Position& at_mm) {
  constexpr double kFewSteps_mm = 0.5;
  constexpr double kSamePlace_mm = 1e-6;
  gcode::Segment left;
  left.start_mm = left.end_mm = at_mm;
  left.feed_mm_s = 1.0;
  left.line = kNoLine;
  for (const gcode::Axis axis : gcode::kXYZ) {
    left.start_mm[axis] = machine_mm[axis];
  }
  const bool is_left = left.length_mm() > kSamePlace_mm && left.length_mm() < kFewSteps_mm;
  return is_left ? std::optional(left) : std::nullopt;
}

Replayed replay(const Piece& run, std::string_view text, gcode::Interpreter printer,
                const planner::Limits& limits, const planner::FirmwareConfig& config,
                const InMotion& in_motion) {
  const std::unique_ptr<planner::Planner> planner = planner::make_planner(limits, config);
  if (in_motion.lines_before.empty() && in_motion.machine_mm) {
    if (const auto left = left_to_next(*in_motion.machine_mm, printer.state().position_mm)) {
      planner->add(*left);
    }
  }
  for (gcode::Segment line : in_motion.lines_before) {
    line.line = kNoLine;
    planner->add(line);
  }
  std::size_t number = 0;
  std::optional<gcode::Segment> last;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
    const gcode::Event event = printer.interpret({std::string(text.substr(0, end)), ++number});
    text.remove_prefix(end);
    planner->apply(event);
    if (event.kind == gcode::EventKind::barrier) {
      planner->stop();
    }
    for (const gcode::Segment& segment : event.segments) {
      planner->add(segment);
      last = segment;
    }
  }
  if (in_motion.goes_on && last && last->length_mm() > 0.0) {
    planner->add(continued(*last));
  }
  planner->stop();
  Replayed replayed;
  planner->take_played(replayed.moves);
  const auto is_around = [](const planner::PlannedMove& move) {
    return move.segment.line == kNoLine;
  };
  const auto first = std::ranges::find_if_not(replayed.moves, is_around);
  if (first != replayed.moves.begin() && !run.begins_run()) {
    replayed.before = *(first - 1);
  }
  std::erase_if(replayed.moves, is_around);
  return replayed;
}

verify::RunError error_of(const verify::DeviationStats& stats, double swing_mm,
                          const verify::NozzleModel& model) {
  return verify::run_error(stats.contour_rms_mm * stats.contour_rms_mm * stats.duration_s,
                           stats.contour_max_mm, stats.duration_s, swing_mm, model);
}

// Why the deviation `after` is worse than `before`; nullopt if it is not. Each counts with the
// swing that is left after the plan's last move, `last`.
std::optional<std::string> worse(const verify::RunDeviation& before,
                                 const verify::RunDeviation& after,
                                 const planner::PlannedMove& last, const verify::Rules& rules) {
  const auto no_worse = [](double a, double b, double nothing) {
    return a <= std::max((1.0 + kSampling) * b, nothing);
  };
  const double chance = rules.leeway.chance_mm;
  const dynamics::NozzleXY as_planned = at_end_of(last, rules.nozzle);
  const double swing_before_mm = verify::apart_mm(before.end, as_planned, rules.nozzle);
  const double swing_after_mm = verify::apart_mm(after.end, as_planned, rules.nozzle);
  if (rules.tolerance_mm > 0.0 && swing_after_mm <= rules.tolerance_mm &&
      after.extruding.stats().contour_max_mm <= verify::kTimesTolerance * rules.tolerance_mm) {
    return std::nullopt;
  }
  if (before.extruding.stats().duration_s > 0.0) {
    const verify::RunError b = error_of(before.extruding.stats(), swing_before_mm, rules.nozzle);
    const verify::RunError a = error_of(after.extruding.stats(), swing_after_mm, rules.nozzle);
    if (no_worse(a.rms_mm, b.rms_mm, kNothingRms_mm) &&
        no_worse(a.max_mm, b.max_mm + chance, kNothing_mm)) {
      return std::nullopt;
    }
    return fmt::format(
        "{}with the swing that is left, contour RMS {:.3f} to {:.3f} µm, largest {:.3f} to {:.3f} "
        "µm",
        kWorse, b.rms_mm * 1e3, a.rms_mm * 1e3, b.max_mm * 1e3, a.max_mm * 1e3);
  }
  // Travel draws nothing, and straight travel has no contour error whatever happens. So its
  // tracking error counts, since it tells what swing is left to the next run. If the firmware
  // rounds the clock of each line, it is enough that this swing is no larger.
  const verify::DeviationStats b = before.all.stats();
  const verify::DeviationStats a = after.all.stats();
  if (no_worse(a.tracking_rms_mm, b.tracking_rms_mm, kNothingRms_mm) ||
      (spec_of(rules.fixed.firmware).motion.rounds_to_steps &&
       no_worse(swing_after_mm, swing_before_mm + chance, kNothing_mm))) {
    return std::nullopt;
  }
  return fmt::format("{}tracking RMS in travel {:.3f} to {:.3f} µm", kWorse,
                     b.tracking_rms_mm * 1e3, a.tracking_rms_mm * 1e3);
}

// Whether the print can bear the deviation `after` although it is worse.
bool is_bearable(const verify::RunDeviation& before, const verify::RunDeviation& after) {
  const verify::DeviationStats b = before.all.stats();
  const verify::DeviationStats a = after.all.stats();
  return a.contour_rms_mm <= std::max(kBearableTimes * b.contour_rms_mm, kBearableRms_mm) &&
         a.contour_max_mm <= std::max(kBearableTimes * b.contour_max_mm, kBearable_mm);
}

}  // namespace

Verdict judge(const Piece& run, const std::vector<planner::PlannedMove>& reference,
              const verify::RunDeviation& before, std::string_view text, gcode::Interpreter printer,
              const planner::Limits& printer_limits, const dynamics::NozzleXY& nozzle,
              const verify::Rules& rules, double lead_in_s, verify::LineRate rate,
              double max_lines_per_s, const InMotion& in_motion) {
  Verdict verdict;
  Replayed replayed = replay(run, text, std::move(printer), printer_limits, rules.fixed, in_motion);
  verdict.replayed = std::move(replayed.moves);
  verdict.objection = verify::broken_rule(run.moves, verdict.replayed, rules,
                                          replayed.before ? &*replayed.before : nullptr);
  if (verdict.objection) {
    return verdict;
  }
  rate.forget();
  rate.change_text();
  verify::LineRate original_rate = rate;
  for (const planner::PlannedMove& move : run.moves) {
    original_rate.add(move);
  }
  for (const planner::PlannedMove& move : verdict.replayed) {
    rate.add(move);
  }
  // If the sliced lines themselves exceed the budget, the run may have as many as they.
  if (rate.max_per_s() > std::max(max_lines_per_s, original_rate.max_per_s())) {
    verdict.objection =
        fmt::format("{:.0f} lines per second are more than emit.max_lines_per_s, {:.0f}",
                    rate.max_per_s(), max_lines_per_s);
    return verdict;
  }
  if (run.begins_run() && !verdict.replayed.empty()) {
    verdict.wait_s = planner::wait_s(verdict.replayed.front(), rules.fixed);
  }
  const verify::RunDeviation after =
      deviation_of(run, reference, verdict.replayed, nozzle, rules, lead_in_s + verdict.wait_s);
  verdict.nozzle = after.end;
  verdict.rate = std::move(rate);
  std::optional<std::string> objection = worse(before, after, reference.back(), rules);
  verdict.worse = objection.has_value();
  if (!(in_motion.may_be_worse && is_bearable(before, after))) {
    verdict.objection = std::move(objection);
  }
  return verdict;
}

}  // namespace unflex::run
