#include "judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace unflex::pipeline {
namespace {

// Deviations below the grid that positions are written on say nothing.
constexpr double kResolutionMm = 1e-4;
// Where the firmware rounds to steps, a single place may be off by part of one by chance.
constexpr double kShareOfStep = 0.1;
// Of the faster axis' ringing.
constexpr double kSamplesPerPeriod = 40.0;
// What that may leave unseen of an error.
constexpr double kSampling = 2e-4;

double chance_mm(const planner::FirmwareConfig& config) {
  return config.firmware == Firmware::klipper
             ? 0.0
             : kShareOfStep /
                   std::min(config.steps_per_mm[gcode::X], config.steps_per_mm[gcode::Y]);
}

// How far the nozzle will swing around a base that rests at `at`.
double swing_mm(const dynamics::NozzleXY& nozzle, const gcode::Position& at,
                const verify::NozzleModel& model) {
  return std::hypot(
      nozzle.x.position - at[gcode::X], nozzle.x.velocity / model.x.omega_rad_s,
      std::hypot(nozzle.y.position - at[gcode::Y], nozzle.y.velocity / model.y.omega_rad_s));
}

}  // namespace

verify::RunDeviation deviation_of(const std::vector<planner::PlannedMove>& reference,
                                  const std::vector<planner::PlannedMove>& base,
                                  const dynamics::NozzleXY& nozzle, const verify::Rules& rules,
                                  double lead_in_s) {
  verify::NozzleModel model = rules.nozzle;
  const double fastest_rad_s = std::max(model.x.omega_rad_s, model.y.omega_rad_s);
  model.step_s =
      std::max(model.step_s, 2.0 * std::numbers::pi / (kSamplesPerPeriod * fastest_rad_s));
  return verify::measure(reference, base, nozzle, model, lead_in_s);
}

Verdict judge(const std::vector<planner::PlannedMove>& original, const verify::RunDeviation& before,
              std::string_view text, gcode::Interpreter printer,
              const planner::Limits& printer_limits, const dynamics::NozzleXY& nozzle,
              const verify::Rules& rules, verify::LineRate rate, double max_lines_per_s) {
  const std::unique_ptr<planner::Planner> planner =
      planner::make_planner(printer_limits, rules.fixed);
  std::size_t line = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1) + 1;
    const gcode::Event event = printer.interpret({std::string(text.substr(0, end)), ++line});
    text.remove_prefix(end);
    planner->apply(event.limits);
    for (const gcode::Segment& segment : event.segments) {
      planner->add(segment);
    }
  }
  planner->stop();
  std::vector<planner::PlannedMove> replayed;
  planner->take(replayed);

  Verdict verdict;
  if (std::optional<std::string> broken = verify::broken_rule(original, replayed, rules)) {
    verdict.objection = std::move(broken);
    return verdict;
  }
  rate.forget();
  rate.change_text();
  verify::LineRate original_rate = rate;
  for (const planner::PlannedMove& move : original) {
    original_rate.add(move);
  }
  for (const planner::PlannedMove& move : replayed) {
    rate.add(move);
  }
  // Where the sliced lines themselves are too many, fewer are better.
  if (rate.max_per_s() > std::max(max_lines_per_s, original_rate.max_per_s())) {
    verdict.objection = fmt::format("{:.0f} lines per second are more than {:.0f}",
                                    rate.max_per_s(), max_lines_per_s);
    return verdict;
  }
  const verify::RunDeviation after =
      deviation_of(original, replayed, nozzle, rules, rules.lead_in_s);
  const auto no_worse = [](double a, double b) {
    return a <= std::max((1.0 + kSampling) * b, kResolutionMm);
  };
  if (before.extruding.stats().duration_s > 0.0) {
    const verify::DeviationStats b = before.extruding.stats();
    const verify::DeviationStats a = after.extruding.stats();
    if (no_worse(a.contour_rms_mm, b.contour_rms_mm) &&
        no_worse(a.contour_max_mm, b.contour_max_mm + chance_mm(rules.fixed))) {
      verdict.nozzle = after.end;
      verdict.rate = std::move(rate);
      verdict.replayed = std::move(replayed);
      return verdict;
    }
    verdict.objection = fmt::format(
        "compensation would be worse: contour RMS {:.3f} to {:.3f} µm, largest {:.3f} to {:.3f} µm",
        b.contour_rms_mm * 1e3, a.contour_rms_mm * 1e3, b.contour_max_mm * 1e3,
        a.contour_max_mm * 1e3);
    return verdict;
  }
  // Travel draws nothing, and a straight one has no contour error whatever it does: what counts is
  // how well the nozzle keeps to where it should be, and so what it leaves to the next run. Where
  // the firmware rounds the clock of each line, only the latter.
  const verify::DeviationStats b = before.all.stats();
  const verify::DeviationStats a = after.all.stats();
  const gcode::Position& end = original.back().segment.end_mm;
  if (no_worse(a.tracking_rms_mm, b.tracking_rms_mm) ||
      (rules.fixed.firmware != Firmware::klipper &&
       no_worse(swing_mm(after.end, end, rules.nozzle),
                swing_mm(before.end, end, rules.nozzle) + chance_mm(rules.fixed)))) {
    verdict.nozzle = after.end;
    verdict.rate = std::move(rate);
    verdict.replayed = std::move(replayed);
    return verdict;
  }
  verdict.objection =
      fmt::format("compensation would be worse: tracking RMS in travel {:.3f} to {:.3f} µm",
                  b.tracking_rms_mm * 1e3, a.tracking_rms_mm * 1e3);
  return verdict;
}

}  // namespace unflex::pipeline
