#include "identification.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "sparkline.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/report/html_page.hpp"
#include "unflex/report/json_parts.hpp"
#include "unflex/report/svg_plot.hpp"

namespace unflex::app {
namespace {

using identify::AxisModel;
using identify::Curve;
using identify::Estimate;
using identify::ModeEstimate;
using identify::ModeOfAxis;
using report::Json;

std::string number_text(double value, const Estimate& estimate) {
  return app::number_text(value, estimate.high - estimate.low);
}

std::string estimate_text(const Estimate& e) { return number_text(e.value, e); }

std::string interval_text(const Estimate& e) {
  return fmt::format("{} to {}", number_text(e.low, e), number_text(e.high, e));
}

// "45.4 Hz (44.9 to 45.9), ζ 0.071 (0.066 to 0.076)", and the gain where there are others.
std::string mode_text(const ModeEstimate& mode, bool is_alone) {
  std::string text =
      fmt::format("{} Hz ({}), ζ {} ({})", estimate_text(mode.freq_hz), interval_text(mode.freq_hz),
                  estimate_text(mode.damping_ratio), interval_text(mode.damping_ratio));
  if (!is_alone) {
    text += fmt::format(", gain {} ({})", estimate_text(mode.gain), interval_text(mode.gain));
  }
  return text;
}

std::string mode_name(const ModeEstimate& mode) {
  return fmt::format("{:.1f} Hz", mode.freq_hz.value);
}

// Where the sensor's own axes lie against the motion; empty where nothing tells.
std::string sensor_text(const std::array<double, 3>& direction) {
  constexpr double kAlone = 0.97;
  constexpr std::string_view kNames = "xyz";
  std::string parts;
  for (std::size_t c = 0; c < 3; ++c) {
    if (std::abs(direction[c]) > kAlone) {
      return fmt::format("the sensor's {}", kNames[c]);
    }
    if (direction[c] != 0.0) {
      parts += fmt::format("{}{} {:.2f}", parts.empty() ? "" : ", ", kNames[c], direction[c]);
    }
  }
  return parts.empty() ? parts : fmt::format("the sensor's {}", parts);
}

// The heights at which a curve is drawn. A spectrum holds energies, which span decades, so we draw
// their roots, the amplitudes. A curve that swings about 0 is drawn as it is.
std::vector<double> heights(const Curve& curve, const std::vector<double>& values) {
  std::vector<double> result;
  for (const double value : values) {
    result.push_back(curve.is_spectrum ? std::sqrt(std::max(value, 0.0)) : value);
  }
  return result;
}

// A curve of a record's picture.
struct Trace {
  std::string name;
  std::vector<double> values;
  std::string colour;
  report::Stroke stroke = report::Stroke::solid;
};

// What was measured and what the model says of it: as a whole, each mode alone, noise, and what is
// left.
std::vector<Trace> traces_of(const IdentifiedRecord& record) {
  constexpr std::array<std::string_view, 3> kColours = {"--series-3", "--series-4", "--series-5"};
  const Curve& curve = record.fit.curve;
  std::vector<Trace> traces = {{"measured", curve.measured, "--series-1", report::Stroke::solid},
                               {record.fit.is_trusted() ? "fitted" : "closest fit", curve.fitted,
                                "--series-2", report::Stroke::dashed}};
  if (!curve.is_spectrum) {
    return traces;
  }
  for (std::size_t m = 0; m < curve.modes.size(); ++m) {
    traces.push_back({mode_name(record.fit.model.modes[m]), curve.modes[m],
                      std::string(kColours.at(m)), report::Stroke::solid});
  }
  traces.push_back({"noise", curve.noise, "--muted", report::Stroke::solid});
  std::vector<double> left;
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    left.push_back(std::abs(curve.measured[i] - curve.fitted[i]));
  }
  traces.push_back({"unexplained", left, "--series-6", report::Stroke::dotted});
  return traces;
}

std::string drawing(const IdentifiedRecord& record) {
  const Curve& curve = record.fit.curve;
  if (curve.x.empty()) {
    return {};
  }
  const std::vector<double> measured = heights(curve, curve.measured);
  const double least = curve.is_spectrum ? 0.0 : *std::ranges::min_element(measured);
  const double most = *std::ranges::max_element(measured);
  if (!(least < most)) {
    return {};
  }
  std::string text;
  for (const Trace& trace : traces_of(record)) {
    text += fmt::format("  {:<13}{}\n", trace.name,
                        sparkline(heights(curve, trace.values), least, most));
  }
  return text + fmt::format("  {:<13}{:.3g} to {:.3g} {}\n", "", curve.x.front(), curve.x.back(),
                            curve.is_spectrum ? "Hz" : "s");
}

std::string record_text(const IdentifiedRecord& record) {
  const std::vector<ModeEstimate>& modes = record.fit.model.modes;
  const std::string sensor = sensor_text(record.fit.direction);
  std::string text =
      fmt::format("{}: along {}{}{}, {}\n", record.name, letter(record.axis),
                  sensor.empty() ? "" : ", ", sensor, to_string(record.fit.model.method));
  if (!record.fit.is_trusted()) {
    text += "  no model of it is to be trusted\n";
  }
  for (const ModeEstimate& mode : modes) {
    text += record.fit.is_trusted() ? fmt::format("  {}\n", mode_text(mode, modes.size() == 1))
                                    : std::string{};
  }
  return text + drawing(record);
}

// "{freq_hz = 45.4, damping_ratio = 0.071, gain = 1}, …"
std::string list_text(const std::vector<ModeOfAxis>& modes, std::string_view between) {
  std::string text;
  for (const ModeOfAxis& mode : modes) {
    text += fmt::format("{}{{freq_hz = {:.2f}, damping_ratio = {:.4f}, gain = {:.4f}}}",
                        text.empty() ? "" : between, mode.freq_hz, mode.damping_ratio, mode.gain);
  }
  return text;
}

std::string plants_text(identify::Axis axis, const AxisModel& model) {
  std::string text;
  for (const identify::Plant& plant : other_plants(model)) {
    text += fmt::format("\n[[dynamics.{}.plant]]\nshare = {:.4f}\nmode = [{}]\n", letter(axis),
                        plant.share, list_text(plant.modes, ",\n        "));
  }
  return text.empty() ? text
                      : "\n# What the records leave open: the axis may be one of these, too.\n" +
                            text.substr(1);
}

std::string modes_text(identify::Axis axis, const AxisModel& model) {
  const auto line = [](std::string_view key, const std::string& value, const Estimate& e) {
    return fmt::format("{} = {}  # 95 %: {}\n", key, value, interval_text(e));
  };
  std::string text;
  for (const ModeEstimate& mode : model.modes) {
    const bool is_alone = model.modes.size() == 1;
    text += fmt::format("{}{}\n", text.empty() ? "" : "\n",
                        is_alone ? fmt::format("[dynamics.{}]", letter(axis))
                                 : fmt::format("[[dynamics.{}.mode]]", letter(axis)));
    text += line("freq_hz", estimate_text(mode.freq_hz), mode.freq_hz) +
            line("damping_ratio", estimate_text(mode.damping_ratio), mode.damping_ratio);
    if (!is_alone) {
      text += line("gain", fmt::format("{:.4f}", mode.gain.value), mode.gain);
    }
  }
  return text;
}

std::string second_text(const Identification& identification) {
  std::string text;
  for (const auto& [axis, model] : identification.axes) {
    const ModeEstimate& mode = model.modes.front();
    for (const auto& [key, e] :
         {std::pair("freq_hz", mode.freq_hz), std::pair("damping_ratio", mode.damping_ratio)}) {
      text += fmt::format("{}_{} = {}  # 95 %: {}\n", letter(axis), key, estimate_text(e),
                          interval_text(e));
    }
  }
  return text.empty() ? text : "[second]\n" + text;
}

Json estimate_json(const Estimate& e) {
  return {{"value", e.value}, {"low", e.low}, {"high", e.high}};
}

Json model_json(const AxisModel& model) {
  Json json;
  json["method"] = to_string(model.method);
  json["modes"] = Json::array();
  for (const ModeEstimate& mode : model.modes) {
    json["modes"].push_back({{"freq_hz", estimate_json(mode.freq_hz)},
                             {"damping_ratio", estimate_json(mode.damping_ratio)},
                             {"gain", estimate_json(mode.gain)}});
  }
  json["covariance"] = model.covariance;
  json["plants"] = Json::array();
  for (const identify::Plant& plant : model.plants) {
    Json modes = Json::array();
    for (const ModeOfAxis& mode : plant.modes) {
      modes.push_back(
          {{"freq_hz", mode.freq_hz}, {"damping_ratio", mode.damping_ratio}, {"gain", mode.gain}});
    }
    json["plants"].push_back({{"share", plant.share}, {"modes", std::move(modes)}});
  }
  return json;
}

Json record_json(const IdentifiedRecord& record) {
  const identify::RecordFit& fit = record.fit;
  Json json = model_json(fit.model);
  json["name"] = record.name;
  json["axis"] = std::string(1, letter(record.axis));
  json["refusal"] = fit.is_trusted() ? Json(nullptr) : Json(fit.refusal);
  json["direction"] = fit.direction;
  json["unexplained"] = fit.unexplained;
  json["bic"] = fit.bic;
  json["curve"] = {{fit.curve.is_spectrum ? "freq_hz" : "time_s", fit.curve.x},
                   {"measured", fit.curve.measured},
                   {"fitted", fit.curve.fitted},
                   {"modes", fit.curve.modes},
                   {"noise", fit.curve.noise}};
  return json;
}

std::string figure(const IdentifiedRecord& record) {
  const Curve& curve = record.fit.curve;
  if (curve.x.empty()) {
    return {};
  }
  report::Plot plot{.title = fmt::format("Measured and fitted, {}", record.name),
                    .x_label = curve.is_spectrum ? "frequency, Hz" : "time, s",
                    .y_label = curve.is_spectrum ? "amplitude, relative" : "acceleration, relative",
                    .width_px = 680,
                    .height_px = 300};
  for (const Trace& trace : traces_of(record)) {
    report::PlotCurve& drawn = plot.curves.emplace_back();
    drawn.label = trace.name;
    drawn.colour = trace.colour;
    drawn.stroke = trace.stroke;
    const std::vector<double> y = heights(curve, trace.values);
    for (std::size_t i = 0; i < curve.x.size(); ++i) {
      drawn.points.push_back({curve.x[i], y[i]});
    }
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
      "<table class=\"data\"><thead><tr><th>frequency (95 %)</th><th>damping ratio (95 %)</th>"
      "<th>gain (95 %)</th></tr></thead><tbody>\n{}</tbody></table>\n",
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
      "<p>By {}{}{}. {:.0f} % of the record is not explained by {}.</p>\n{}{}{}</section>\n",
      report::escape_html(record.name), letter(record.axis), to_string(fit.model.method),
      sensor.empty() ? "" : ", along ", sensor, 100.0 * fit.unexplained,
      fit.is_trusted() ? "the model" : "the closest fit", remarks,
      fit.is_trusted() ? modes_table(fit.model) : std::string{}, figure(record));
}

std::string found_text(const Identification& identification) {
  std::string found;
  for (const auto& [axis, model] : identification.axes) {
    std::string modes;
    for (const ModeEstimate& mode : model.modes) {
      modes += fmt::format("{}{}", modes.empty() ? "" : " and ", estimate_text(mode.freq_hz));
    }
    found += fmt::format("{}{} {} Hz", found.empty() ? "" : ", ", letter(axis), modes);
  }
  return found;
}

}  // namespace

std::string snippet(const Identification& identification) {
  if (identification.is_second) {
    return second_text(identification);
  }
  std::string text;
  for (const auto& [axis, model] : identification.axes) {
    text += (text.empty() ? "" : "\n") + modes_text(axis, model) + plants_text(axis, model);
  }
  return text;
}

std::vector<std::string> dynamics_overrides(const Identification& identification) {
  std::vector<std::string> overrides;
  for (const auto& [axis, model] : identification.axes) {
    const std::string section = fmt::format("dynamics.{}", letter(axis));
    const std::vector<ModeOfAxis>& modes = model.values();
    if (modes.size() == 1) {
      overrides.push_back(fmt::format("{}.freq_hz={:.3f}", section, modes.front().freq_hz));
      overrides.push_back(
          fmt::format("{}.damping_ratio={:.4f}", section, modes.front().damping_ratio));
    } else {
      overrides.push_back(fmt::format("{}.mode=[{}]", section, list_text(modes, ", ")));
    }
    std::string plants;
    for (const identify::Plant& plant : other_plants(model)) {
      plants += fmt::format("{}{{share = {:.4f}, mode = [{}]}}", plants.empty() ? "" : ", ",
                            plant.share, list_text(plant.modes, ", "));
    }
    if (!plants.empty()) {
      overrides.push_back(fmt::format("{}.plant=[{}]", section, plants));
    }
  }
  return overrides;
}

std::string identification_text(const Identification& identification) {
  std::string text;
  for (const IdentifiedRecord& record : identification.records) {
    text += record_text(record) + "\n";
  }
  return text + snippet(identification);
}

std::string identification_json(const Identification& identification) {
  Json json;
  json["schema_version"] = report::kSchemaVersion;
  json["command"] = "identify";
  json["version"] = version();
  json["dynamics"] = Json::object();
  for (const auto& [axis, model] : identification.axes) {
    json["dynamics"][std::string(1, letter(axis))] = model_json(model);
  }
  json["records"] = Json::array();
  for (const IdentifiedRecord& record : identification.records) {
    json["records"].push_back(record_json(record));
  }
  json["snippet"] = snippet(identification);
  json["warnings"] = identification.warnings;
  return report::dump(json);
}

std::string identification_html(const Identification& identification) {
  const std::string found = found_text(identification);
  std::string body =
      found.empty()
          ? std::string("<section class=\"card\"><h2>No record carries a model</h2></section>\n")
          : fmt::format(
                "<section class=\"card\"><h2>{}: {}</h2>\n<p>For the "
                "printer file:</p>\n<pre>{}</pre></section>\n",
                identification.is_second ? "What still rings" : "The nozzle swings", found,
                report::escape_html(snippet(identification)));
  for (const IdentifiedRecord& record : identification.records) {
    body += record_card(record);
  }
  return report::html_page({.title = "Resonances",
                            .style = ".plot { width: 100%; height: auto; max-width: 60rem; }",
                            .body = body,
                            .script = {}});
}

}  // namespace unflex::app
