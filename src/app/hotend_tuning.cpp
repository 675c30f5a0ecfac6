#include "hotend_tuning.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "sparkline.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/hotend/firmware_words.hpp"
#include "unflex/report/html_page.hpp"
#include "unflex/report/json_parts.hpp"
#include "unflex/report/svg_plot.hpp"

namespace unflex::app {
namespace {

using hotend::Estimate;
using hotend::Plant;
using hotend::PlantFit;
using hotend::Response;
using report::Json;

// Time between drawn points. A simulated response is recorded more densely than anyone can see.
constexpr double kDrawnStep_s = 1.0;
// Half the width of an interval that holds the truth in 95 of 100 cases, in standard errors.
constexpr double kErrorsOf95 = 1.96;

struct Interval {
  double low = 0.0;
  double high = 0.0;
};

// Gain, lags and dead time are not negative.
Interval interval_of(const Estimate& estimate, bool is_positive) {
  const double half = kErrorsOf95 * estimate.error;
  const double low = estimate.value - half;
  return {is_positive ? std::max(low, 0.0) : low, estimate.value + half};
}

// A value of the model as it is shown. Its error is not known without a log.
struct ModelRow {
  std::string_view key;  // of the printer file
  std::string_view name;
  std::string_view unit;
  double value = 0.0;
  Estimate estimate;  // without an error if there is none
};

std::vector<ModelRow> model_rows(const Plant& plant, const PlantFit* fit) {
  const PlantFit none;
  const PlantFit& of = fit == nullptr ? none : *fit;
  return {{"gain_c", "gain", "°C per count", plant.gain_c, of.gain_c},
          {"time_constant_s", "time constant", "s", plant.time_constant_s, of.time_constant_s},
          {"sensor_lag_s", "sensor lag", "s", plant.sensor_lag_s, of.sensor_lag_s},
          {"dead_time_s", "dead time", "s", plant.dead_time_s, of.dead_time_s},
          {"ambient_c", "ambient", "°C", plant.ambient_c, of.ambient_c}};
}

std::vector<ModelRow> model_rows(const HotendTuning& tuning) {
  return model_rows(*tuning.plant, tuning.log ? &tuning.log->fit : nullptr);
}

std::string value_text(const ModelRow& row) {
  const std::string text = row.estimate.error > 0.0
                               ? number_text(row.value, 2.0 * kErrorsOf95 * row.estimate.error)
                               : fmt::format("{:.5g}", row.value);
  // A wide interval may round the dead time to 0, which a printer file does not take.
  const bool is_lost = row.value != 0.0 && text.find_first_of("123456789") == std::string::npos;
  return is_lost ? fmt::format("{:.1g}", row.value) : text;
}

// "1.98 to 2.02", or nothing where no error is known.
std::string interval_text(const ModelRow& row) {
  if (!(row.estimate.error > 0.0)) {
    return {};
  }
  const Interval interval = interval_of(row.estimate, row.key != "ambient_c");
  const double width = 2.0 * kErrorsOf95 * row.estimate.error;
  return fmt::format("{} to {}", number_text(interval.low, width),
                     number_text(interval.high, width));
}

std::string model_text(const std::vector<ModelRow>& rows) {
  std::string text;
  for (const ModelRow& row : rows) {
    const std::string interval = interval_text(row);
    text += fmt::format("  {:<15}{} {}{}\n", row.name, value_text(row), row.unit,
                        interval.empty() ? interval : fmt::format(" ({})", interval));
  }
  return text;
}

std::vector<double> measured_of(const hotend::Log& log) {
  std::vector<double> values;
  for (const hotend::Sample& sample : log.samples) {
    values.push_back(sample.temperature_c);
  }
  return values;
}

std::vector<double> powers_of(const hotend::Log& log) {
  std::vector<double> values;
  for (const hotend::Sample& sample : log.samples) {
    values.push_back(sample.power);
  }
  return values;
}

std::vector<double> times_of(const hotend::Log& log) {
  std::vector<double> values;
  for (const hotend::Sample& sample : log.samples) {
    values.push_back(sample.time_s);
  }
  return values;
}

std::string_view name_of_fit(const HotendLog& log) {
  return log.refusal.empty() ? "fitted" : "closest fit";
}

std::string log_text(const HotendLog& log) {
  const std::vector<hotend::Sample>& samples = log.log.samples;
  const std::vector<double> measured = measured_of(log.log);
  const auto [least, most] = std::ranges::minmax(measured);
  std::string text =
      fmt::format("{}: {} samples in {:.0f} s, {:.1f} % unexplained, noise {:.2f} °C\n", log.name,
                  samples.size(), samples.back().time_s - samples.front().time_s,
                  100.0 * log.fit.unexplained, log.fit.noise_c);
  text += fmt::format("  {:<15}{}\n", "measured", sparkline(measured, least, most));
  text += fmt::format("  {:<15}{}\n", name_of_fit(log), sparkline(log.fit.fitted_c, least, most));
  text +=
      fmt::format("  {:<15}{}\n", "power", sparkline(powers_of(log.log), 0.0, hotend::kFullPower));
  return text + fmt::format("  {:<15}{:.0f} to {:.0f} °C, {:.0f} to {:.0f} s\n", "", least, most,
                            samples.front().time_s, samples.back().time_s);
}

std::string settled_text(const Response& step) {
  return step.settled_s ? fmt::format("{:.0f} s", *step.settled_s) : std::string("never");
}

// One value for each second, up to the time after which nothing changes any more.
struct Drawn {
  std::vector<double> time_s;
  std::vector<double> temperature_c;
  std::vector<double> power;
};

Drawn drawn(const Response& response) {
  constexpr double kShortest_s = 120.0;
  constexpr double kBehindSettling = 2.0;
  const auto stride = static_cast<std::size_t>(std::lround(kDrawnStep_s / response.step_s));
  const double end_s = response.settled_s
                           ? std::max(kShortest_s, kBehindSettling * *response.settled_s)
                           : response.step_s * static_cast<double>(response.temperature_c.size());
  const std::size_t count = std::min(response.temperature_c.size(), response.power.size());
  Drawn result;
  for (std::size_t i = 0; i < count; i += stride) {
    const double time_s = response.step_s * static_cast<double>(i);
    if (time_s > end_s) {
      break;
    }
    result.time_s.push_back(time_s);
    result.temperature_c.push_back(response.temperature_c[i]);
    result.power.push_back(response.power[i]);
  }
  return result;
}

std::string load_name(const HotendLoad& load) {
  return fmt::format("{:g} mm³/s ({:.1f} W)", load.flow_mm3_s, load.power_w);
}

std::string step_text(const HotendTuning& tuning, const RuleOutcome& chosen) {
  const Response& step = *chosen.step;
  const Drawn curve = drawn(step);
  std::string text =
      fmt::format("step from {:.0f} to {:.0f} °C by {}: peak {:.1f} °C, within 1 % after {}\n",
                  tuning.plant->ambient_c, tuning.target_c, to_string(chosen.rule), step.peak_c,
                  settled_text(step));
  if (chosen.load) {
    text += fmt::format("{} then take the temperature off by up to {:.1f} °C\n",
                        load_name(*tuning.load), chosen.load->worst_c);
  }
  text += fmt::format("  {:<15}{}\n", "simulated",
                      sparkline(curve.temperature_c, tuning.plant->ambient_c,
                                std::max(tuning.target_c, step.peak_c)));
  text +=
      fmt::format("  {:<15}{}\n", "power", sparkline(curve.power, 0.0, tuning.plant->full_power));
  return text + fmt::format("  {:<15}{:.0f} to {:.0f} s\n\n", "", curve.time_s.front(),
                            curve.time_s.back());
}

// All rules beside each other, the chosen one with a mark.
std::string rules_text(const HotendTuning& tuning) {
  const bool has_steps = tuning.plant.has_value();
  std::string text = fmt::format("  {:<9}{:>8}{:>9}{:>9}", "rule", "Kp", "Ki", "Kd");
  text += has_steps ? fmt::format("{:>10}{:>13}", "peak °C", "within 1 %") : std::string{};
  text += tuning.load ? fmt::format("{:>15}", "under load °C") : std::string{};
  text += "\n";
  for (const RuleOutcome& outcome : tuning.rules) {
    text += fmt::format("{} {:<9}{:>8.2f}{:>9.4f}{:>9.2f}", outcome.rule == tuning.rule ? '>' : ' ',
                        to_string(outcome.rule), outcome.gains.p, outcome.gains.i, outcome.gains.d);
    text += outcome.step
                ? fmt::format("{:>10.1f}{:>13}", outcome.step->peak_c, settled_text(*outcome.step))
                : std::string{};
    text += outcome.load ? fmt::format("{:>15.1f}", outcome.load->worst_c) : std::string{};
    text += "\n";
  }
  return text;
}

bool is_bed(const HotendTuning& tuning) { return tuning.heater == "heater_bed"; }

std::string marlin_text(const HotendTuning& tuning) {
  std::string words = hotend::marlin_words(tuning.chosen()->gains);
  return is_bed(tuning) ? words.replace(0, 4, "M304") : words;
}

std::string rrf_text(const HotendTuning& tuning) {
  return hotend::rrf_words(hotend::rrf_model(*tuning.plant, tuning.target_c),
                           is_bed(tuning) ? 0 : 1);
}

Json gains_json(const hotend::Gains& gains) {
  return {{"p", gains.p}, {"i", gains.i}, {"d", gains.d}};
}

Json optional_json(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json rule_json(const RuleOutcome& outcome) {
  const bool has_step = outcome.step.has_value();
  return {{"rule", to_string(outcome.rule)},
          {"gains", gains_json(outcome.gains)},
          {"peak_c", has_step ? Json(outcome.step->peak_c) : Json(nullptr)},
          {"settled_s", has_step ? optional_json(outcome.step->settled_s) : Json(nullptr)},
          {"worst_c", has_step ? Json(outcome.step->worst_c) : Json(nullptr)},
          {"worst_under_load_c", outcome.load ? Json(outcome.load->worst_c) : Json(nullptr)}};
}

Json model_json(const std::vector<ModelRow>& rows) {
  Json json = Json::object();
  for (const ModelRow& row : rows) {
    const Interval interval = interval_of(row.estimate, row.key != "ambient_c");
    const bool has_interval = row.estimate.error > 0.0;
    json[std::string(row.key)] = {{"value", row.value},
                                  {"low", has_interval ? Json(interval.low) : Json(nullptr)},
                                  {"high", has_interval ? Json(interval.high) : Json(nullptr)}};
  }
  return json;
}

Json log_json(const HotendLog& log) {
  return {{"name", log.name},
          {"refusal", log.refusal.empty() ? Json(nullptr) : Json(log.refusal)},
          {"unexplained", log.fit.unexplained},
          {"noise_c", log.fit.noise_c},
          {"started_at_rest", log.fit.started_at_rest},
          {"model", model_json(model_rows(log.fit.plant, &log.fit))},
          {"curve",
           {{"time_s", times_of(log.log)},
            {"measured_c", measured_of(log.log)},
            {"fitted_c", log.fit.fitted_c},
            {"power", powers_of(log.log)}}}};
}

Json step_json(const RuleOutcome& outcome) {
  const Drawn curve = drawn(*outcome.step);
  return {{"time_s", curve.time_s}, {"temperature_c", curve.temperature_c}, {"power", curve.power}};
}

report::PlotCurve plot_curve(std::string label, std::string colour, report::Stroke stroke,
                             const std::vector<double>& x, const std::vector<double>& y) {
  report::PlotCurve curve;
  curve.label = std::move(label);
  curve.colour = std::move(colour);
  curve.stroke = stroke;
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); ++i) {
    curve.points.push_back({x[i], y[i]});
  }
  return curve;
}

std::string figure(std::string title, std::string y_label, std::vector<report::PlotCurve> curves,
                   int height_px = 300) {
  report::Plot plot{.title = std::move(title),
                    .x_label = "time, s",
                    .y_label = std::move(y_label),
                    .width_px = 680,
                    .height_px = height_px};
  plot.curves = std::move(curves);
  return report::svg_plot(plot) + report::svg_legend(plot);
}

std::string power_figure(const std::string& title, const std::vector<double>& time_s,
                         const std::vector<double>& power) {
  constexpr int kLow_px = 160;
  return figure(title, "power, counts",
                {plot_curve("power", "--series-3", report::Stroke::solid, time_s, power)}, kLow_px);
}

std::string model_table(const std::vector<ModelRow>& rows) {
  std::string body;
  for (const ModelRow& row : rows) {
    body += fmt::format("<tr><td>{}</td><td>{} {}</td><td>{}</td></tr>\n", row.name,
                        value_text(row), row.unit, interval_text(row));
  }
  return fmt::format(
      "<table class=\"data\"><thead><tr><th>model</th><th>value</th><th>95 %</th></tr></thead>"
      "<tbody>\n{}</tbody></table>\n",
      body);
}

std::string log_card(const HotendLog& log) {
  const std::vector<double> time_s = times_of(log.log);
  const std::string refusal =
      log.refusal.empty() ? std::string{}
                          : fmt::format("<p role=\"alert\"><strong>Not used:</strong> {}</p>\n",
                                        report::escape_html(log.refusal));
  return fmt::format(
      "<section class=\"card\"><h2>{}</h2>\n<p>{} samples. {:.1f} % of the temperature's changes "
      "are not explained by {}; noise is {:.2f} °C.</p>\n{}{}{}{}</section>\n",
      report::escape_html(log.name), log.log.samples.size(), 100.0 * log.fit.unexplained,
      log.refusal.empty() ? "the model" : "the closest fit", log.fit.noise_c, refusal,
      log.refusal.empty() ? model_table(model_rows(log.fit.plant, &log.fit)) : std::string{},
      figure("Measured and fitted temperature", "temperature, °C",
             {plot_curve("measured", "--series-1", report::Stroke::solid, time_s,
                         measured_of(log.log)),
              plot_curve(std::string(name_of_fit(log)), "--series-2", report::Stroke::dashed,
                         time_s, log.fit.fitted_c)}),
      power_figure("Power in the log", time_s, powers_of(log.log)));
}

std::string rules_table(const HotendTuning& tuning) {
  std::string rows;
  for (const RuleOutcome& outcome : tuning.rules) {
    const bool is_chosen = outcome.rule == tuning.rule;
    rows += fmt::format("<tr><td>{}{}{}</td><td>{:.2f}</td><td>{:.4f}</td><td>{:.2f}</td>",
                        is_chosen ? "<strong>" : "", to_string(outcome.rule),
                        is_chosen ? "</strong>" : "", outcome.gains.p, outcome.gains.i,
                        outcome.gains.d);
    rows += outcome.step ? fmt::format("<td>{:.1f} °C</td><td>{}</td>", outcome.step->peak_c,
                                       settled_text(*outcome.step))
                         : std::string{};
    rows += outcome.load ? fmt::format("<td>{:.1f} °C</td>", outcome.load->worst_c) : std::string{};
    rows += "</tr>\n";
  }
  return fmt::format(
      "<table class=\"data\"><thead><tr><th>rule</th><th>K<sub>p</sub></th><th>K<sub>i</sub></th>"
      "<th>K<sub>d</sub></th>{}{}</tr></thead><tbody>\n{}</tbody></table>\n",
      tuning.plant ? "<th>peak</th><th>within 1 %</th>" : "",
      tuning.load ? fmt::format("<th>error under {}</th>", load_name(*tuning.load)) : std::string{},
      rows);
}

std::string step_figures(const HotendTuning& tuning) {
  const RuleOutcome& chosen = *tuning.chosen();
  const Drawn curve = drawn(*chosen.step);
  const std::vector<double> target(curve.time_s.size(), tuning.target_c);
  return figure("Simulated step", "temperature, °C",
                {plot_curve(std::string(to_string(chosen.rule)), "--series-1",
                            report::Stroke::solid, curve.time_s, curve.temperature_c),
                 plot_curve("target", "--muted", report::Stroke::dotted, curve.time_s, target)}) +
         power_figure("Power of the simulated step", curve.time_s, curve.power);
}

std::string rules_card(const HotendTuning& tuning) {
  const std::string title = tuning.plant ? fmt::format("A step from {:.0f} to {:.0f} °C, simulated",
                                                       tuning.plant->ambient_c, tuning.target_c)
                                         : std::string("Gains of each rule");
  return fmt::format("<section class=\"card\"><h2>{}</h2>\n{}{}</section>\n", title,
                     tuning.plant ? step_figures(tuning) : std::string{}, rules_table(tuning));
}

std::string words_card(const HotendTuning& tuning) {
  const std::string model = model_snippet(tuning);
  return fmt::format("<section class=\"card\"><h2>Gains by {}</h2>\n<pre>{}</pre>\n{}</section>\n",
                     to_string(tuning.rule), report::escape_html(words_text(tuning)),
                     model.empty() ? model
                                   : fmt::format("<p>For the printer file:</p>\n<pre>{}</pre>",
                                                 report::escape_html(model)));
}

}  // namespace

const RuleOutcome* HotendTuning::chosen() const {
  const auto found = std::ranges::find(rules, rule, &RuleOutcome::rule);
  return found == rules.end() ? nullptr : &*found;
}

std::string words_text(const HotendTuning& tuning) {
  if (tuning.chosen() == nullptr) {
    return {};
  }
  std::string text = fmt::format("# Klipper: [{}] of printer.cfg\ncontrol = pid\n{}", tuning.heater,
                                 hotend::klipper_words(tuning.chosen()->gains));
  text += fmt::format("# Marlin: then M500\n{}\n", marlin_text(tuning));
  return tuning.plant ? text + fmt::format(
                                   "# RepRapFirmware: config.g; it chooses its own gains "
                                   "by the model\n{}\n",
                                   rrf_text(tuning))
                      : text;
}

std::string model_snippet(const HotendTuning& tuning) {
  if (!tuning.log || !tuning.plant || !tuning.heater.starts_with("extruder")) {
    return {};
  }
  std::string text = "[hotend]\n";
  for (const ModelRow& row : model_rows(tuning)) {
    const std::string interval = interval_text(row);
    text += fmt::format("{} = {}{}\n", row.key, value_text(row),
                        interval.empty() ? interval : fmt::format("  # 95 %: {}", interval));
  }
  return text +
         (tuning.heater_w ? fmt::format("heater_w = {:g}\n", *tuning.heater_w) : std::string{});
}

std::string tuning_text(const HotendTuning& tuning) {
  std::string text = tuning.log ? log_text(*tuning.log) : std::string{};
  if (tuning.log && !tuning.plant) {
    return text + "  no model of it is to be trusted\n";
  }
  text += tuning.plant ? model_text(model_rows(tuning)) : std::string{};
  if (tuning.ultimate) {
    text += fmt::format("  {:<15}{:.2f} counts per °C, period {:.1f} s\n", "ultimate gain",
                        tuning.ultimate->gain, tuning.ultimate->period_s);
  }
  text += "\n";
  text += tuning.plant ? step_text(tuning, *tuning.chosen()) : std::string{};
  text += rules_text(tuning) + "\n" + words_text(tuning);
  const std::string model = model_snippet(tuning);
  return model.empty() ? text : text + "\n" + model;
}

std::string tuning_json(const HotendTuning& tuning) {
  Json json;
  json["schema_version"] = report::kSchemaVersion;
  json["command"] = "hotend";
  json["version"] = version();
  json["log"] = tuning.log ? log_json(*tuning.log) : Json(nullptr);
  json["model"] = tuning.plant ? model_json(model_rows(tuning)) : Json(nullptr);
  json["ultimate"] = tuning.ultimate ? Json{{"gain", tuning.ultimate->gain},
                                            {"period_s", tuning.ultimate->period_s}}
                                     : Json(nullptr);
  json["target_c"] = tuning.plant ? Json(tuning.target_c) : Json(nullptr);
  json["load"] = tuning.load ? Json{{"flow_mm3_s", tuning.load->flow_mm3_s},
                                    {"power_w", tuning.load->power_w},
                                    {"counts", tuning.load->counts}}
                             : Json(nullptr);
  json["rule"] = to_string(tuning.rule);
  json["rules"] = Json::array();
  for (const RuleOutcome& outcome : tuning.rules) {
    json["rules"].push_back(rule_json(outcome));
  }
  const RuleOutcome* const chosen = tuning.chosen();
  json["step"] = chosen != nullptr && chosen->step ? step_json(*chosen) : Json(nullptr);
  json["words"] = {
      {"klipper", chosen != nullptr ? Json(hotend::klipper_words(chosen->gains)) : Json(nullptr)},
      {"marlin", chosen != nullptr ? Json(marlin_text(tuning)) : Json(nullptr)},
      {"rrf", chosen != nullptr && tuning.plant ? Json(rrf_text(tuning)) : Json(nullptr)}};
  json["snippet"] = model_snippet(tuning);
  json["warnings"] = tuning.warnings;
  return report::dump(json);
}

std::string tuning_html(const HotendTuning& tuning) {
  std::string body = tuning.chosen() != nullptr
                         ? words_card(tuning)
                         : std::string(
                               "<section class=\"card\"><h2>The log carries no model</h2>"
                               "</section>\n");
  body += tuning.log     ? log_card(*tuning.log)
          : tuning.plant ? fmt::format("<section class=\"card\"><h2>The model</h2>\n{}</section>\n",
                                       model_table(model_rows(tuning)))
                         : std::string{};
  body += tuning.chosen() != nullptr ? rules_card(tuning) : std::string{};
  return report::html_page({.title = "Hotend",
                            .style = ".plot { width: 100%; height: auto; max-width: 60rem; }",
                            .body = body,
                            .script = {}});
}

}  // namespace unflex::app
