#include <fmt/core.h>

#include <algorithm>
#include <string>
#include <vector>

#include "assets.hpp"
#include "identification.hpp"
#include "identification_parts.hpp"
#include "identification_places.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/dynamics/shapers.hpp"
#include "unflex/report/html_page.hpp"
#include "unflex/report/svg_plot.hpp"

namespace unflex::app {
namespace {

using identify::AxisModel;
using identify::Curve;
using identify::ModeEstimate;

// "MZV 45.2 Hz".
std::string shaper_text(const rivals::FittedShaper& shaper) {
  return fmt::format("{} {:.1f} Hz", dynamics::name(shaper.kind), shaper.freq_hz);
}

// The part of a vibration that the shaper leaves. The whole vibration is as high as the record.
report::PlotCurve shaper_curve(const rivals::FittedShaper& shaper, const Curve& curve) {
  const std::vector<double> measured = heights(curve, curve.measured);
  const double all = *std::ranges::max_element(measured);
  const std::vector<double> left = rivals::amplitude_left(shaper.pulses(), curve.x);
  report::PlotCurve drawn;
  drawn.label = fmt::format("what {} leaves", shaper_text(shaper));
  drawn.colour = "--series-4";
  drawn.stroke = report::Stroke::dotted;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    drawn.points.push_back({curve.x[i], all * left[i]});
  }
  return drawn;
}

// all: draws the parts of the fit. Otherwise draws the measurement, the model's curve, and the
// vibration that Klipper's shaper would leave.
std::string figure(const IdentifiedRecord& record, bool all) {
  const Curve& curve = record.fit.curve;
  if (curve.x.empty()) {
    return {};
  }
  report::Plot plot{.title = fmt::format("Measured and fitted, {}", record.name),
                    .x_label = curve.is_spectrum ? "frequency, Hz" : "time, s",
                    .y_label = curve.is_spectrum ? "amplitude, relative" : "acceleration, relative",
                    .width_px = 420,
                    .height_px = 260};
  std::vector<Trace> traces = traces_of(record);
  traces.resize(all ? traces.size() : std::min<std::size_t>(traces.size(), 2));
  for (const Trace& trace : traces) {
    report::PlotCurve& drawn = plot.curves.emplace_back();
    drawn.label = trace.name;
    drawn.colour = trace.colour;
    drawn.stroke = trace.stroke;
    const std::vector<double> y = heights(curve, trace.values);
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      drawn.points.push_back({curve.x[i], y[i]});
    }
  }
  if (record.shaper && !all) {
    plot.curves.push_back(shaper_curve(*record.shaper, curve));
  }
  return report::svg_plot(plot) + report::svg_legend(plot);
}

std::string modes_table(const AxisModel& model) {
  std::string rows;
  for (const ModeEstimate& mode : model.modes) {
    rows += fmt::format("<tr><td>{} Hz ({})</td><td>{} ({})</td><td>{} ({})</td></tr>\n",
                        estimate_text(mode.freq_hz), interval_text(mode.freq_hz),
                        estimate_text(mode.damping_ratio), interval_text(mode.damping_ratio),
                        estimate_text(mode.gain), interval_text(mode.gain));
  }
  return fmt::format(
      "<div class=\"scroll\"><table class=\"data\"><thead><tr><th>frequency (95 %)</th>"
      "<th>damping ratio (95 %)</th><th>gain (95 %)</th></tr></thead><tbody>\n{}</tbody></table>"
      "</div>\n",
      rows);
}

std::string record_card(const IdentifiedRecord& record) {
  const identify::RecordFit& fit = record.fit;
  std::string remarks;
  if (!fit.is_trusted()) {
    remarks = fmt::format("<p role=\"alert\"><strong>Not used:</strong> {}</p>\n",
                          report::escape_html(fit.refusal));
  }
  for (const std::string& warning : fit.warnings) {
    remarks += fmt::format("<p role=\"note\"><strong>Mind:</strong> {}</p>\n",
                           report::escape_html(warning));
  }
  const std::string sensor = sensor_text(fit.direction);
  return fmt::format(
      "<section class=\"card\"><h2>{} along {}</h2>\n"
      "<p>By {}{}{}. {:.0f} % of the record is not explained by {}.</p>\n{}{}<div "
      "class=\"picture\">{}</div></section>\n",
      report::escape_html(record.name), letter(record.axis), to_string(fit.model.method),
      sensor.empty() ? "" : ", along ", sensor, 100.0 * fit.unexplained,
      fit.is_trusted() ? "the model" : "the closest fit", remarks,
      fit.is_trusted() ? modes_table(fit.model) : std::string{}, figure(record, true));
}

// "x at 45.4 and 60.1 Hz".
std::string found_text(identify::Axis axis, const AxisModel& model) {
  std::string modes;
  for (std::size_t m = 0; m < model.modes.size(); ++m) {
    modes += fmt::format("{}{}",
                         m == 0                        ? ""
                         : m + 1 == model.modes.size() ? " and "
                                                       : ", ",
                         estimate_text(model.modes[m].freq_hz));
  }
  return fmt::format("{} at {} Hz", letter(axis), modes);
}

// The record of an axis that people look at first.
const IdentifiedRecord* record_of(const Identification& identification, identify::Axis axis) {
  const auto record = std::ranges::find_if(
      identification.records,
      [&](const IdentifiedRecord& each) { return each.axis == axis && each.fit.is_trusted(); });
  return record == identification.records.end() ? nullptr : &*record;
}

// The findings in one sentence and one picture for each axis, and the lines to paste.
std::string answer_card(const Identification& identification) {
  std::string found;
  std::string pictures;
  std::string shapers;
  for (const auto& [axis, model] : identification.axes) {
    found += fmt::format("{}{}", found.empty() ? "" : ", ", found_text(axis, model));
    if (const IdentifiedRecord* const record = record_of(identification, axis)) {
      pictures +=
          fmt::format("<figure>{}<figcaption class=\"note\">along {}: {}</figcaption></figure>\n",
                      figure(*record, false), letter(axis), report::escape_html(record->name));
      if (record->shaper) {
        shapers += fmt::format("{}{} for {}", shapers.empty() ? "" : ", ",
                               shaper_text(*record->shaper), letter(axis));
      }
    }
  }
  std::string places;
  for (const auto& [axis, all] : identification.over_places) {
    places += places_html(axis, all);
  }
  return fmt::format(
      "<section class=\"card\"><h2>{}: {}</h2>\n<div class=\"figures\">\n{}</div>\n{}{}"
      "<details><summary>Lines for the printer file</summary>\n<button type=\"button\" "
      "id=\"copy\">Copy</button>\n<pre id=\"lines\">{}</pre></details></section>\n",
      identification.is_second ? "What still rings" : "The nozzle swings", found, pictures, places,
      shapers.empty() ? std::string{}
                      : fmt::format("<p class=\"note\">Klipper would set up {}. At full height a "
                                    "shaper leaves all of a vibration.</p>\n",
                                    shapers),
      report::escape_html(snippet(identification)));
}

}  // namespace

std::string identification_html(const Identification& identification) {
  std::string body =
      identification.axes.empty()
          ? std::string("<section class=\"card\"><h2>No record carries a model</h2></section>\n")
          : answer_card(identification);
  for (const IdentifiedRecord& record : identification.records) {
    body += record_card(record);
  }
  return report::html_page(
      {.title = "Resonances",
       .style = "figure { margin: 0 0 .75rem; }\n.picture { max-width: 44rem; }\n"
                "h2, figcaption { overflow-wrap: anywhere; }\npre { overflow-x: auto; }",
       .body = body,
       .script = std::string(assets::copy_js)});
}

}  // namespace unflex::app
