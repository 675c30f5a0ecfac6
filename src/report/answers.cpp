#include "answers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "unflex/report/format.hpp"

namespace unflex::report {
namespace {

constexpr double kOff = 0.05;

bool is_off(double error) { return std::abs(std::abs(error) - kOff) < 1e-9; }

const Contender* contender(const Report& report, std::string_view name) {
  if (!report.recording) {
    return nullptr;
  }
  const auto& all = report.recording->contenders;
  const auto found = std::ranges::find(all, name, &Contender::name);
  return found != all.end() && !found->spreads.empty() ? &*found : nullptr;
}

std::string now_text(const Report& report) {
  if (report.measured.unshaped) {
    return report.facts.shaper.empty()
               ? "under the input shaper that the print sets"
               : fmt::format("under the printer's own input shaper, {}", report.facts.shaper);
  }
  return report.facts.shaper_unknown ? "without an input shaper, as none is known"
                                     : "without an input shaper";
}

std::optional<Place> first(const std::vector<Place>& places) {
  return places.empty() ? std::nullopt : std::optional(places.front());
}

std::string motors_text(const Report& report, double times_own_accel) {
  const PrinterFacts& facts = report.facts;
  std::string text =
      fmt::format("Motors are asked for at most {:.0f} mm/s and {:.0f} mm/s²",
                  report.measured.base.max_velocity_mm_s, report.measured.base.max_accel_mm_s2);
  const bool fast = report.measured.base.max_velocity_mm_s > facts.motor_max_velocity_mm_s;
  const std::string own_accel =
      fmt::format("{:.0f} mm/s² ({})", facts.motor_max_accel_mm_s2, facts.motor_max_accel_origin);
  if (times_own_accel > 1.0) {
    text += fmt::format(": {:.1f} times the printer's own limit of {}", times_own_accel, own_accel);
  } else {
    text += fmt::format(", within the printer's own limit of {}", own_accel);
  }
  if (fast) {
    text += fmt::format(", and above its {:.0f} mm/s", facts.motor_max_velocity_mm_s);
  }
  return text + ".";
}

std::string kept_text(const Report& report) {
  const double kept = 1.0 - report.extruded_path.compensated_share();
  std::string text = fmt::format("{} of the extruded path is compensated",
                                 share_text(report.extruded_path.compensated_share()));
  if (kept > 0.0) {
    const auto most = std::ranges::max_element(report.extruded_path.kept_mm, {},
                                               [](const auto& entry) { return entry.second; });
    if (most != report.extruded_path.kept_mm.end()) {
      text += fmt::format("; the rest stays as sliced, most of it because of: {}", most->first);
    }
  }
  return text + ".";
}

}  // namespace

double times_smaller(const Comparison& comparison) {
  return comparison.compensated_mm > 0.0 ? comparison.now_mm / comparison.compensated_mm : 0.0;
}

double Better::times() const { return times_smaller(exact); }

Better better(const Report& report) {
  const bool shaped = report.measured.unshaped.has_value();
  const Contender* const zv = shaped ? nullptr : contender(report, "ZV");
  const auto zv_where = [&](const auto& counts) {
    std::optional<double> most;
    for (std::size_t i = 0; zv != nullptr && i < zv->spreads.size(); ++i) {
      if (counts(report.recording->frequency_errors[i])) {
        most = std::max(most.value_or(0.0), zv->spreads[i].rms_mm);
      }
    }
    return most;
  };
  Better result;
  result.now = now_text(report);
  result.exact = {report.measured.uncompensated.extruding.contour_rms_mm,
                  report.measured.compensated.extruding.contour_rms_mm,
                  zv_where([](double error) { return error == 0.0; })};
  if (report.measured.uncompensated.line.is_known()) {
    result.edge = {report.measured.uncompensated.line.edge.rms_mm,
                   report.measured.compensated.line.edge.rms_mm, std::nullopt};
  }
  for (const Sensitivity& one : report.others.sensitivity) {
    if (is_off(one.frequency_error)) {
      Comparison& off = result.off ? *result.off : result.off.emplace();
      off.now_mm = std::max(off.now_mm, one.uncompensated.rms_mm);
      off.compensated_mm = std::max(off.compensated_mm, one.compensated.rms_mm);
    }
  }
  if (result.off) {
    result.off->zv_mm = zv_where(is_off);
  }
  return result;
}

std::vector<std::string> faster_texts(const Report& report) {
  if (report.free_timing.tolerance_mm <= 0.0 || report.measured.uncompensated.time_s <= 0.0) {
    return {};
  }
  const double change =
      1.0 - report.measured.compensated.time_s / report.measured.uncompensated.time_s;
  std::vector<std::string> lines = {
      fmt::format("{} → {} to print, {:.0f} % {}; the nozzle may stray {:.4g} µm and {}",
                  duration_text(report.measured.uncompensated.time_s),
                  duration_text(report.measured.compensated.time_s), 100.0 * std::abs(change),
                  change >= 0.0 ? "less" : "more", report.free_timing.tolerance_mm * 1e3,
                  keeps_tolerance(report) ? "keeps to it" : "strays further in places")};
  constexpr double kWorthIt = 0.02;  // of the print time
  if (const std::optional<NarrowerBand>& narrower = report.free_timing.narrower;
      narrower && narrower->saves_s > kWorthIt * report.measured.compensated.time_s) {
    lines.push_back(fmt::format(
        "Frequencies known to {0:.3g} % would save some {1:.0f} % more: "
        "dynamics.freq_error = {2:.3g}",
        100.0 * narrower->freq_error,
        100.0 * narrower->saves_s / report.measured.compensated.time_s, narrower->freq_error));
  }
  return lines;
}

std::optional<std::string> hardly_worth_it(const Report& report) {
  const double strays_mm = report.measured.uncompensated.extruding.contour_p99_mm;
  if (report.free_timing.tolerance_mm > 0.0 || strays_mm >= kSeen_mm) {
    return std::nullopt;
  }
  return fmt::format(
      "Hardly worth it: as sliced 99 % of the time are within {} µm, and an eye sees {:.0f}",
      micrometres_text(strays_mm), 1e3 * kSeen_mm);
}

std::string width_text(const Report& report) {
  if (!report.measured.uncompensated.line.is_known()) {
    return "How wide the line comes out is not known: give pressure.advance_s, the pressure "
           "advance that the hotend needs; unflex tune --pressure finds it by printing";
  }
  const verify::WidthStats& before = report.measured.uncompensated.line.width;
  const verify::WidthStats& after = report.measured.compensated.line.width;
  const auto written = std::ranges::find(report.printer, "pressure.written", &Setting::key);
  const bool may_be =
      written != report.printer.end() ? written->value == "false" : report.firmware != "klipper";
  return fmt::format("The line's width is {} % RMS off, {} for 99 % of the way{}",
                     percent_change_text(before.rms, after.rms),
                     percent_change_text(before.p99, after.p99),
                     may_be ? "; pressure.written = true may lay it more evenly" : "");
}

Worst worst(const Report& report) {
  Worst result;
  if (!report.recording) {
    return result;
  }
  const Recording& recording = *report.recording;
  result.compensated = first(recording.worst_after);
  result.now = first(recording.worst_before);
  for (std::size_t i = 0; i < std::min(recording.start_layers, recording.layers.size()); ++i) {
    const BeforeAfter& spread = recording.layers[i].spread;
    BeforeAfter& start = result.start ? *result.start : result.start.emplace();
    start.before.max_mm = std::max(start.before.max_mm, spread.before.max_mm);
    start.after.max_mm = std::max(start.after.max_mm, spread.after.max_mm);
  }
  return result;
}

std::size_t slicers_layer(const Recording& recording, std::size_t layer) {
  return layer < recording.start_layers ? 0 : layer - recording.start_layers + 1;
}

std::string layer_text(const Recording& recording, std::size_t layer) {
  const std::size_t number = slicers_layer(recording, layer);
  return number == 0 ? "before the first layer" : fmt::format("layer {}", number);
}

std::string place_text(const Recording& recording, const Place& place) {
  std::string text = fmt::format("line {}, {}", place.line, layer_text(recording, place.layer));
  if (place.feature < recording.features.size() &&
      !recording.features[place.feature].name.empty()) {
    text += ", " + recording.features[place.feature].name;
  }
  return text + fmt::format(", at X{:.1f} Y{:.1f}", place.xy_mm.x, place.xy_mm.y);
}

Safe safe(const Report& report) {
  Safe result;
  result.is_safe = report.violation_count == 0;
  const PrinterFacts& facts = report.facts;
  if (report.violation_count > 0) {
    result.reasons.push_back(fmt::format("{} {} broken, the first: {}", report.violation_count,
                                         report.violation_count == 1 ? "rule is" : "rules are",
                                         report.violations.empty() ? "" : report.violations[0]));
  }
  if (report.measured.base.max_accel_mm_s2 > 0.0) {
    result.times_own_accel =
        facts.motor_max_accel_mm_s2 > 0.0
            ? report.measured.base.max_accel_mm_s2 / facts.motor_max_accel_mm_s2
            : 0.0;
    result.reasons.push_back(motors_text(report, result.times_own_accel));
    result.reasons.push_back(
        fmt::format("Their speed changes by at most {:.1f} mm/s from line to line.",
                    report.measured.base.max_step_mm_s));
  }
  result.reasons.push_back(
      facts.travel.empty()
          ? "The printer's travel is not known and not checked: give printer.travel_x_mm and _y_mm."
          : fmt::format("The travel was checked: {}.", facts.travel));
  result.reasons.push_back(fmt::format("At most {:.0f} lines come in a second; {} takes {:.0f}.",
                                       report.measured.output.max_lines_per_s, facts.lines_source,
                                       facts.max_lines_per_s));
  if (!report.solver.engine.empty() && report.extruded_path.total_mm > 0.0) {
    result.reasons.push_back(kept_text(report));
  }
  return result;
}

std::string made_for_text(const Report& report) {
  std::string text;
  for (const PrinterFacts::Axis& axis : report.facts.axes) {
    text +=
        fmt::format("{}{} {} ({})", text.empty() ? "" : "; ", axis.name, axis.model, axis.origin);
  }
  return text + (report.others.freq_error > 0.0 ? fmt::format("; frequencies up to {:.3g} % off",
                                                              100.0 * report.others.freq_error)
                                                : "; exact frequencies");
}

}  // namespace unflex::report
