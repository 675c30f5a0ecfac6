#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string_view>

#include "answers.hpp"
#include "text_places.hpp"
#include "unflex/core/number.hpp"
#include "unflex/report/format.hpp"

namespace unflex::report {
namespace {

constexpr double kMicrometresPerMm = 1e3;
constexpr std::size_t kListedFallbacks = 3;
constexpr std::size_t kListedCommands = 5;

// The first line with its title, the others below it.
void write_answer(Sink out, std::string_view title, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    fmt::format_to(out, "{:<14}{}\n", title, line);
    title = "";
  }
}

std::string zv_text(const Better& answer) {
  std::string text =
      fmt::format("A ZV shaper would leave {} µm", micrometres_text(*answer.exact.zv_mm));
  if (answer.off && answer.off->zv_mm) {
    text += fmt::format(", {} if they are 5 % off", micrometres_text(*answer.off->zv_mm));
  }
  return text;
}

void write_better(Sink out, const Report& r) {
  const Better answer = better(r);
  // A print that was to be faster may stray more than now, as far as it was allowed.
  const std::vector<std::string> faster = faster_texts(r);
  write_answer(out, "Faster?", faster);
  const bool is_allowed = !faster.empty() && answer.times() < 1.0;
  const std::string times = is_allowed ? "" : ": " + times_text(answer.times());
  std::vector<std::string> lines;
  if (answer.edge) {
    lines.push_back(fmt::format("{} µm RMS at the edges of the line: {} ({})",
                                change_text(answer.edge->now_mm, answer.edge->compensated_mm),
                                times_text(times_smaller(*answer.edge)), answer.now));
    lines.push_back(width_text(r));
    lines.push_back(fmt::format("The nozzle is {} µm RMS from the path{}",
                                change_text(answer.exact.now_mm, answer.exact.compensated_mm),
                                times));
  } else {
    lines.push_back(fmt::format("{} µm RMS from the path{} ({})",
                                change_text(answer.exact.now_mm, answer.exact.compensated_mm),
                                times, answer.now));
    lines.push_back(width_text(r));
  }
  if (answer.off) {
    lines.push_back(fmt::format("{} if the frequencies are 5 % off",
                                change_text(answer.off->now_mm, answer.off->compensated_mm)));
  }
  if (answer.exact.zv_mm) {
    lines.push_back(zv_text(answer));
  }
  if (const std::optional<std::string> text = hardly_worth_it(r)) {
    lines.push_back(*text);
  }
  write_answer(out, "Better?", lines);
}

void write_worst(Sink out, const Report& r) {
  const Worst answer = worst(r);
  std::vector<std::string> lines;
  if (answer.compensated) {
    lines.push_back(fmt::format("{} µm in {}", micrometres_text(answer.compensated->after_mm),
                                place_text(*r.recording, *answer.compensated)));
  }
  if (answer.now) {
    lines.push_back(fmt::format("Now {} µm in {}", micrometres_text(answer.now->before_mm),
                                place_text(*r.recording, *answer.now)));
  }
  if (answer.start) {
    lines.push_back(
        fmt::format("Before the first layer {} µm at most",
                    change_text(answer.start->before.max_mm, answer.start->after.max_mm)));
  }
  write_answer(out, "Where worst?", lines);
}

void write_safe(Sink out, const Safe& answer) {
  std::vector<std::string> lines = {answer.is_safe ? "Yes, every rule is kept."
                                                   : "NO, do not print it."};
  lines.insert(lines.end(), answer.reasons.begin(), answer.reasons.end());
  write_answer(out, "Safe?", lines);
}

void write_answers(Sink out, const Report& r) {
  const Safe answer = safe(r);
  if (!answer.is_safe) {
    write_safe(out, answer);
  }
  write_better(out, r);
  write_worst(out, r);
  if (answer.is_safe) {
    write_safe(out, answer);
  }
  write_answer(out, "Made for", {made_for_text(r)});
  if (!r.warnings.empty()) {
    write_answer(out, "Warnings",
                 {fmt::format("{}, the first: {}", r.warnings.size(), r.warnings.front())});
  }
  fmt::format_to(out, "\n");
}

void write_deviation(Sink out, std::string_view moves, const verify::DeviationStats& before,
                     const verify::DeviationStats& after) {
  fmt::format_to(out, "  {:<16}{:<20}{:<20}{}\n", moves,
                 change_text(before.contour_max_mm, after.contour_max_mm),
                 change_text(before.contour_p99_mm, after.contour_p99_mm),
                 change_text(before.contour_rms_mm, after.contour_rms_mm));
}

void write_corners(Sink out, const verify::CornerStats& before, const verify::CornerStats& after) {
  if (before.count > 0) {
    fmt::format_to(out, "  {:<16}{:<20}{:<20}{}\n", fmt::format("{} corners", before.count),
                   change_text(before.max_mm, after.max_mm),
                   change_text(before.p99_mm, after.p99_mm),
                   change_text(before.rms_mm, after.rms_mm));
  }
}

void write_line(Sink out, const verify::LineStats& before, const verify::LineStats& after) {
  if (!before.is_known()) {
    return;
  }
  fmt::format_to(out, "  {:<16}{:<20}{:<20}{}\n", "edges of lines",
                 change_text(before.edge.max_mm, after.edge.max_mm),
                 change_text(before.edge.p99_mm, after.edge.p99_mm),
                 change_text(before.edge.rms_mm, after.edge.rms_mm));
  const auto change = [&](verify::OtherHotend hotend) {
    return width_change_text(before, after, hotend);
  };
  fmt::format_to(out,
                 "width         {:+.0f} → {:+.0f} % off at most, near lines {} and {}; {:.1f} → "
                 "{:.1f} % of the way are more than 10 % off\n"
                 "              {} % RMS if the pressure is 20 % lower, {} if it is higher; {} if "
                 "the dead time is 2 ms longer\n",
                 100.0 * before.width.largest, 100.0 * after.width.largest, before.width.line,
                 after.width.line, 100.0 * before.width.wide, 100.0 * after.width.wide,
                 change(verify::OtherHotend::less_pressure),
                 change(verify::OtherHotend::more_pressure), change(verify::OtherHotend::later));
}

// The figures without the printer's own shaper, which is on in the figures before.
void write_unshaped(Sink out, const std::optional<verify::Deviation>& unshaped) {
  if (unshaped) {
    const verify::DeviationStats& row = unshaped->extruding;
    fmt::format_to(
        out,
        "shaper        the printer's own is on before; without it, extruding: {} µm max, "
        "{} p99, {} RMS\n",
        micrometres_text(row.contour_max_mm), micrometres_text(row.contour_p99_mm),
        micrometres_text(row.contour_rms_mm));
  }
}

// The error by how far the true frequencies are off.
void write_sensitivity(Sink out, const Report& r) {
  if (r.others.sensitivity.empty()) {
    return;
  }
  std::string errors;
  std::string rms;
  const auto add = [&](const std::string& error, double rms_mm) {
    errors += (errors.empty() ? "" : ", ") + error;
    rms += (rms.empty() ? "" : ", ") + micrometres_text(rms_mm);
  };
  bool has_exact = false;
  for (const Sensitivity& one : r.others.sensitivity) {
    if (!has_exact && one.frequency_error > 0.0) {
      add("0", r.measured.compensated.extruding.contour_rms_mm);
      has_exact = true;
    }
    add(fmt::format("{:+.0f}", 100.0 * one.frequency_error), one.compensated.rms_mm);
  }
  fmt::format_to(out, "sensitivity   {} µm RMS if frequencies are off by {} %{}\n", rms, errors,
                 r.others.freq_error > 0.0
                     ? fmt::format("; made for ±{:.3g} %", 100.0 * r.others.freq_error)
                     : "");
}

void write_plants(Sink out, const std::vector<PlantDeviation>& plants) {
  if (!plants.empty()) {
    fmt::format_to(out, "plants        {} µm RMS if the axes are as one of {} plants, {} before\n",
                   range_text(plants, &PlantDeviation::compensated), plants.size(),
                   range_text(plants, &PlantDeviation::uncompensated));
  }
}

void write_times(Sink out, const Report& r) {
  const double change =
      r.measured.uncompensated.time_s > 0.0
          ? 100.0 * (r.measured.compensated.time_s - r.measured.uncompensated.time_s) /
                r.measured.uncompensated.time_s
          : 0.0;
  fmt::format_to(out, "print time    {} planned, {} emitted ({:+.2f} %)\n",
                 duration_text(r.measured.uncompensated.time_s),
                 duration_text(r.measured.compensated.time_s), change);
}

void write_timing(Sink out, const Report& r) {
  const FreeTiming& timing = r.free_timing;
  if (timing.tolerance_mm <= 0.0) {
    return;
  }
  fmt::format_to(out,
                 "timing        as fast as {:.4g} µm allow: 99.9 % of the time within {} µm, the "
                 "nozzle at {:.3f} F at most\n",
                 timing.tolerance_mm * 1e3,
                 micrometres_text(r.measured.compensated.extruding.contour_p999_mm),
                 r.measured.compensated_feed.max);
  if (timing.pieces_scaled > 0) {
    fmt::format_to(
        out, "              {} {} no optimal timing, and a scaled one instead\n",
        timing.pieces_scaled,
        timing.pieces_scaled == 1 ? "stretch of motion has" : "stretches of motion have");
  }
  if (timing.pieces_as_sliced > 0) {
    fmt::format_to(
        out, "              {} {} the slicer's timing\n", timing.pieces_as_sliced,
        timing.pieces_as_sliced == 1 ? "stretch of motion keeps" : "stretches of motion keep");
  }
}

void write_runs(Sink out, const Report& r) {
  if (r.runs.total == 0 && r.runs.windows_total == 0) {
    return;
  }
  fmt::format_to(out, "runs          {} of {} stretches of motion compensated, {} stay as sliced\n",
                 r.runs.compensated, r.runs.total, r.runs.fallback);
  const std::size_t listed = std::min(r.runs.fallbacks.size(), kListedFallbacks);
  for (std::size_t i = 0; i < listed; ++i) {
    const Fallback& kept = r.runs.fallbacks[i];
    fmt::format_to(out, "              lines {}-{}: {}\n", kept.first_line, kept.last_line,
                   kept.reason);
  }
  if (r.runs.fallback > listed) {
    fmt::format_to(out, "              and {} more, listed by --report\n",
                   r.runs.fallback - listed);
  }
  for (const auto& [reason, count] : r.runs.kept_moves) {
    fmt::format_to(out, "              {} other moves stay as they are: {}\n", count, reason);
  }
  fmt::format_to(out, "solver        {}, {} parts, {} iterations\n", r.solver.engine,
                 r.runs.windows_total, r.solver.iterations);
  if (r.solver.check.windows > 0) {
    fmt::format_to(out, "              on {} of them Ipopt finds the same within {} µm\n",
                   r.solver.check.windows, micrometres_text(r.solver.check.largest_difference_mm));
  }
}

void write_path(Sink out, const Report& r) {
  if (r.solver.engine.empty() || !(r.extruded_path.total_mm > 0.0)) {
    return;
  }
  fmt::format_to(out, "path          {} of {:.0f} mm extruded are compensated\n",
                 share_text(r.extruded_path.compensated_share()), r.extruded_path.total_mm);
  for (const auto& [reason, length_mm] : r.extruded_path.kept_mm) {
    fmt::format_to(out, "              {:.1f} mm stay as they are: {}\n", length_mm, reason);
  }
}

// Most prints ask for no more flow than before. Then the line is left out.
void write_flow(Sink out, const Report& r) {
  constexpr double kAsBefore = 1.02;
  const verify::FlowStats& before = r.measured.uncompensated.flow;
  const verify::FlowStats& after = r.measured.compensated.flow;
  if (!r.max_flow_mm3_s && after.max_mm3_s <= kAsBefore * before.max_mm3_s) {
    return;
  }
  fmt::format_to(
      out, "flow          {:.1f} → {:.1f} mm³/s at most{}\n", before.max_mm3_s, after.max_mm3_s,
      r.max_flow_mm3_s ? fmt::format("; the hotend melts {:.1f}", *r.max_flow_mm3_s) : "");
}

void write_output(Sink out, const Report& r) {
  fmt::format_to(out, "output        {} lines, {:.1f} MB, {:.0f} lines/s at peak\n",
                 r.measured.output.lines, static_cast<double>(r.measured.output.bytes) * 1e-6,
                 r.measured.output.max_lines_per_s);
  if (!r.solver.engine.empty()) {
    const LineBudget& budget = r.line_budget;
    fmt::format_to(out, "lines         having few costs {} µm RMS, {} µm at most; ",
                   micrometres_text(budget.cost_rms_mm), micrometres_text(budget.cost_max_mm));
    if (budget.places_above == 0) {
      fmt::format_to(out, "never more than {:.0f} per second\n", budget.max_lines_per_s);
    } else {
      fmt::format_to(out, "more than {:.0f} per second in {} places, the first at line {}\n",
                     budget.max_lines_per_s, budget.places_above, budget.above.front().first_line);
    }
  }
  fmt::format_to(out, "filament      {:.2f} mm in, {:.2f} mm out\n",
                 r.measured.uncompensated.extrusion_mm, r.measured.compensated.extrusion_mm);
  if (!r.measured.uncompensated.line.is_known()) {
    fmt::format_to(
        out,
        "              laid {} → {} µm RMS ahead of the nozzle or behind, {} → {} µm at most\n",
        micrometres_text(r.measured.uncompensated.lag.rms_mm),
        micrometres_text(r.measured.compensated.lag.rms_mm),
        micrometres_text(r.measured.uncompensated.lag.max_mm),
        micrometres_text(r.measured.compensated.lag.max_mm));
  }
  if (r.measured.flow_difference) {
    fmt::format_to(out, "              {}\n", flow_difference_text(*r.measured.flow_difference));
  }
  if (r.fitted_filament) {
    const FittedFilament& fitted = *r.fitted_filament;
    fmt::format_to(out,
                   "              fitted before: {:.2f} mm of moves that print became {:.2f}, "
                   "{:.1f} mm³ of material\n",
                   fitted.sliced_mm, fitted.fitted_mm, fitted.material_mm3);
  }
  write_flow(out, r);
  fmt::format_to(out, "{}", step_rates_text(r.step_rates, /*has_output=*/true));
  fmt::format_to(out, "{}", temperature_text(r.temperature));
  fmt::format_to(out, "speed         {:.0f} s of print per second, {} in all, {:.0f} MB\n",
                 r.performance.print_s_per_wall_s, duration_text(r.performance.wall_s),
                 r.performance.peak_rss_mb);
}

}  // namespace

std::string micrometres_text(double mm) {
  const double um = mm * kMicrometresPerMm;
  if (um >= 100.0) {
    return fmt::format("{:.0f}", um);
  }
  return um >= 10.0 ? fmt::format("{:.1f}", um) : fmt::format("{:.2f}", um);
}

std::string flow_difference_text(const verify::FlowDifference& difference) {
  return fmt::format(
      "at most {:.1f} % {} than as sliced over 10 ms, near line {}; {:.1f} for 99 % of the time",
      100.0 * std::abs(difference.relative), difference.relative < 0.0 ? "less" : "more",
      difference.line, 100.0 * difference.p99);
}

std::string width_change_text(const verify::LineStats& before, const verify::LineStats& after,
                              verify::OtherHotend hotend) {
  return percent_change_text(before.width_with(hotend).rms, after.width_with(hotend).rms);
}

std::string percent_change_text(double from, double to) {
  // micrometres_text() counts thousandths of a millimetre, so percents are scaled to them.
  constexpr double kPercent = 100.0;
  return fmt::format("{} → {}", micrometres_text(from * kPercent / kMicrometresPerMm),
                     micrometres_text(to * kPercent / kMicrometresPerMm));
}

std::string times_text(double times) {
  constexpr double kLittle = 1.05;
  if (!(times > 0.0)) {
    return "no error is left";
  }
  if (times < kLittle && times > 1.0 / kLittle) {
    return "as much as now";
  }
  const double factor = times > 1.0 ? times : 1.0 / times;
  return fmt::format("{:.{}f} times {} than now", factor, factor >= 9.95 ? 0 : 1,
                     times > 1.0 ? "less" : "MORE");
}

std::string unknown_text(const std::vector<UnknownCommand>& commands) {
  std::string text;
  const Sink out = std::back_inserter(text);
  std::string_view title = "unknown";
  const std::size_t listed = std::min(commands.size(), kListedCommands);
  for (std::size_t i = 0; i < listed; ++i) {
    const UnknownCommand& one = commands[i];
    fmt::format_to(
        out,
        "{:<14}{}, {}×, first in line {}: {} moves behind it stay as they are, {:.1f} mm "
        "of them extruded\n",
        title, one.command, one.count, one.first_line, one.moves_kept, one.kept_mm);
    title = "";
  }
  if (commands.size() > listed) {
    fmt::format_to(out, "              and {} more, listed by --report\n",
                   commands.size() - listed);
  }
  return text;
}

std::string range_text(const std::vector<PlantDeviation>& plants, Spread PlantDeviation::*which) {
  const auto rms = [&](const PlantDeviation& plant) { return (plant.*which).rms_mm; };
  const auto [least, most] = std::ranges::minmax(plants, {}, rms);
  return fmt::format("{} to {}", micrometres_text(rms(least)), micrometres_text(rms(most)));
}

std::string share_text(double share) {
  constexpr double kTenths = 1000.0;
  return fmt::format("{:.1f} %", share < 1.0 ? std::floor(share * kTenths) / 10.0 : 100.0);
}

std::string setting_text(std::string_view value) {
  constexpr std::string_view kOfNumbers = "0123456789.+-e";
  // A number may follow one of these: [-4.5, 235], {freq_hz = 45, gain = 1}.
  constexpr std::string_view kBefore = "[, ";
  std::string text;
  bool quoted = false;
  for (std::size_t at = 0; at < value.size();) {
    quoted = quoted != (value[at] == '"');
    const bool begins = !quoted && (at == 0 || kBefore.find(value[at - 1]) != kBefore.npos);
    const std::size_t end = std::min(value.find_first_not_of(kOfNumbers, at), value.size());
    const std::string_view word = value.substr(at, begins ? end - at : 0);
    const std::optional<double> number = parse_number(word);
    text += number ? readable(*number) : std::string(1, value[at]);
    at += number ? word.size() : 1;
  }
  return text;
}

std::string duration_text(double seconds) {
  // From 59.95 s on, tenths would round to 60.0.
  if (!(seconds >= 59.95)) {
    return fmt::format("{:.1f}s", seconds);
  }
  const auto whole = static_cast<long long>(seconds + 0.5);
  const long long hours = whole / 3600;
  const long long minutes = whole / 60 % 60;
  return hours > 0 ? fmt::format("{}h {:02}m {:02}s", hours, minutes, whole % 60)
                   : fmt::format("{}m {:02}s", minutes, whole % 60);
}

std::string to_text(const Report& report) {
  std::string text;
  const Sink out = std::back_inserter(text);
  fmt::format_to(out, "{} → {}\n", report.input, report.output);
  write_answers(out, report);
  fmt::format_to(out, "  {:<16}{:<20}{:<20}{}\n", "off path, µm", "max", "p99", "RMS");
  write_deviation(out, "extruding", report.measured.uncompensated.extruding,
                  report.measured.compensated.extruding);
  write_deviation(out, "all moves", report.measured.uncompensated.all,
                  report.measured.compensated.all);
  if (report.measured.compensated.all.contour_max_mm >
      report.measured.uncompensated.all.contour_max_mm) {
    fmt::format_to(out,
                   "                  (in travel, where nothing is laid, straying is harmless)\n");
  }
  write_corners(out, report.measured.uncompensated.corners, report.measured.compensated.corners);
  write_height(out, report.measured.uncompensated.height, report.measured.compensated.height);
  write_places(out, report.measured.uncompensated.places, report.measured.compensated.places);
  write_line(out, report.measured.uncompensated.line, report.measured.compensated.line);
  write_sensitivity(out, report);
  write_unshaped(out, report.measured.unshaped);
  write_plants(out, report.others.plants);
  if (report.others.robustness) {
    fmt::format_to(
        out,
        "band          suiting it leaves {} instead of {} µm RMS where the frequencies are exact\n",
        micrometres_text(report.others.robustness->rms_mm),
        micrometres_text(report.others.robustness->nominal_rms_mm));
  }
  write_times(out, report);
  write_timing(out, report);
  write_runs(out, report);
  write_path(out, report);
  text += unknown_text(report.unknown_commands);
  write_output(out, report);
  if (!report.shaper_left_off.empty()) {
    fmt::format_to(
        out,
        "input shaper  off after the print, since the printer's own is not known; if it has one "
        "type {}\n              with the frequencies of its configuration, or "
        "give printer.input_shaper_freq_x_hz and _y_hz (0 if it has none)\n",
        report.shaper_left_off);
  }
  return text;
}

}  // namespace unflex::report
