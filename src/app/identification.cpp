#include "identification.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "unflex/app/run_config.hpp"
#include "unflex/report/html_page.hpp"
#include "unflex/report/json_parts.hpp"
#include "unflex/report/svg_plot.hpp"

namespace unflex::app {
namespace {

using identify::Curve;
using identify::Estimate;
using identify::Mode;
using report::Json;

// The value with digits down to a tenth of its interval; more would tell nothing.
std::string number_text(double value, const Estimate& estimate) {
  const double width = std::max(estimate.high - estimate.low, 1e-9 * std::abs(value));
  const int decimals = std::clamp(static_cast<int>(std::ceil(1.0 - std::log10(width))), 0, 5);
  return fmt::format("{:.{}f}", value, decimals);
}

std::string estimate_text(const Estimate& e) { return number_text(e.value, e); }

std::string interval_text(const Estimate& e) {
  return fmt::format("{} to {}", number_text(e.low, e), number_text(e.high, e));
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

std::string sparkline(const std::vector<double>& values, double least, double most) {
  constexpr std::array<std::string_view, 8> kBlocks = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  constexpr std::size_t kColumns = 64;
  const std::size_t columns = std::min(kColumns, values.size());
  std::string line;
  for (std::size_t column = 0; column < columns; ++column) {
    const std::size_t from = column * values.size() / columns;
    const std::size_t to = std::max(from + 1, (column + 1) * values.size() / columns);
    double sum = 0.0;
    for (std::size_t i = from; i < to; ++i) {
      sum += values[i];
    }
    const double share = (sum / static_cast<double>(to - from) - least) / (most - least);
    line += kBlocks[static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * 7.0 + 0.5)];
  }
  return line;
}

std::string drawing(const Curve& curve) {
  if (curve.x.empty()) {
    return {};
  }
  const std::vector<double> measured = heights(curve, curve.measured);
  const std::vector<double> fitted = heights(curve, curve.fitted);
  const auto [least, most] = std::ranges::minmax(measured);
  if (!(least < most)) {
    return {};
  }
  return fmt::format("  measured  {}\n  fitted    {}\n            {:.3g} to {:.3g} {}\n",
                     sparkline(measured, least, most), sparkline(fitted, least, most),
                     curve.x.front(), curve.x.back(), curve.is_spectrum ? "Hz" : "s");
}

Json estimate_json(const Estimate& e) {
  return {{"value", e.value}, {"low", e.low}, {"high", e.high}};
}

Json mode_json(const Mode& mode) {
  return {{"method", to_string(mode.method)},
          {"freq_hz", estimate_json(mode.freq_hz)},
          {"damping_ratio", estimate_json(mode.damping_ratio)},
          {"unexplained", mode.unexplained}};
}

report::PlotCurve plot_curve(const Curve& curve, std::string label,
                             const std::vector<double>& values, std::string colour,
                             report::Stroke stroke) {
  report::PlotCurve drawn;
  drawn.label = std::move(label);
  drawn.colour = std::move(colour);
  drawn.stroke = stroke;
  const std::vector<double> y = heights(curve, values);
  for (std::size_t i = 0; i < curve.x.size(); ++i) {
    drawn.points.push_back({curve.x[i], y[i]});
  }
  return drawn;
}

std::string figure(const IdentifiedRecord& record) {
  const Curve& curve = record.mode.curve;
  if (curve.x.empty()) {
    return {};
  }
  const bool is_spectrum = curve.is_spectrum;
  const report::Plot plot{
      .title = fmt::format("Measured and fitted, {}", record.name),
      .x_label = is_spectrum ? "frequency, Hz" : "time, s",
      .y_label = is_spectrum ? "amplitude, relative" : "acceleration, relative",
      .width_px = 680,
      .height_px = 300,
      .curves = {plot_curve(curve, "measured", curve.measured, "--series-1", report::Stroke::solid),
                 plot_curve(curve, "fitted", curve.fitted, "--series-2", report::Stroke::dashed)}};
  return report::svg_plot(plot) + report::svg_legend(plot);
}

std::string record_card(const IdentifiedRecord& record) {
  std::string warnings;
  for (const std::string& warning : record.mode.warnings) {
    warnings += fmt::format("<p role=\"note\"><strong>Mind:</strong> {}</p>\n",
                            report::escape_html(warning));
  }
  return fmt::format(
      "<section class=\"card\"><h2>{} along {}</h2>\n"
      "<p>{} Hz ({}), damping ratio {} ({}), by {}; {:.0f} % of the record is not explained by "
      "this mode.</p>\n{}{}"
      "</section>\n",
      report::escape_html(record.name), letter(record.axis), estimate_text(record.mode.freq_hz),
      interval_text(record.mode.freq_hz), estimate_text(record.mode.damping_ratio),
      interval_text(record.mode.damping_ratio), to_string(record.mode.method),
      100.0 * record.mode.unexplained, warnings, figure(record));
}

}  // namespace

std::string snippet(const Identification& identification) {
  std::string text;
  for (const auto& [axis, mode] : identification.axes) {
    text +=
        fmt::format("{}[dynamics.{}]\nfreq_hz = {}  # 95 %: {}\ndamping_ratio = {}  # 95 %: {}\n",
                    text.empty() ? "" : "\n", letter(axis), estimate_text(mode.freq_hz),
                    interval_text(mode.freq_hz), estimate_text(mode.damping_ratio),
                    interval_text(mode.damping_ratio));
  }
  return text;
}

std::string identification_text(const Identification& identification) {
  std::string text;
  for (const IdentifiedRecord& record : identification.records) {
    text += fmt::format("{}: along {}, {}\n  {} Hz ({}), ζ {} ({})\n{}\n", record.name,
                        letter(record.axis), to_string(record.mode.method),
                        estimate_text(record.mode.freq_hz), interval_text(record.mode.freq_hz),
                        estimate_text(record.mode.damping_ratio),
                        interval_text(record.mode.damping_ratio), drawing(record.mode.curve));
  }
  return text + snippet(identification);
}

std::string identification_json(const Identification& identification) {
  Json json;
  json["schema_version"] = report::kSchemaVersion;
  json["command"] = "identify";
  json["version"] = version();
  json["dynamics"] = Json::object();
  for (const auto& [axis, mode] : identification.axes) {
    json["dynamics"][std::string(1, letter(axis))] = mode_json(mode);
  }
  json["records"] = Json::array();
  for (const IdentifiedRecord& record : identification.records) {
    Json one = mode_json(record.mode);
    one["name"] = record.name;
    one["axis"] = std::string(1, letter(record.axis));
    one["curve"] = {{record.mode.curve.is_spectrum ? "freq_hz" : "time_s", record.mode.curve.x},
                    {"measured", record.mode.curve.measured},
                    {"fitted", record.mode.curve.fitted}};
    json["records"].push_back(std::move(one));
  }
  json["snippet"] = snippet(identification);
  json["warnings"] = identification.warnings;
  return report::dump(json);
}

std::string identification_html(const Identification& identification) {
  std::string found;
  for (const auto& [axis, mode] : identification.axes) {
    found += fmt::format("{}{} {} Hz", found.empty() ? "" : ", ", letter(axis),
                         estimate_text(mode.freq_hz));
  }
  std::string body = fmt::format(
      "<section class=\"card\"><h2>The nozzle swings: {}</h2>\n<p>For the printer file:</p>\n"
      "<pre>{}</pre></section>\n",
      found, report::escape_html(snippet(identification)));
  for (const IdentifiedRecord& record : identification.records) {
    body += record_card(record);
  }
  return report::html_page({.title = "Resonances",
                            .style = ".plot { width: 100%; height: auto; max-width: 60rem; }",
                            .body = body,
                            .script = {}});
}

}  // namespace unflex::app
