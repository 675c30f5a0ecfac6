#include "unflex/report/temperature.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <utility>

#include "temperature_card.hpp"
#include "unflex/report/format.hpp"
#include "unflex/report/html_page.hpp"
#include "unflex/report/json_parts.hpp"
#include "unflex/report/svg_plot.hpp"

namespace unflex::report {
namespace {

Json row_json(const TemperatureRow& row) {
  return {{"colder_s", row.colder_s},
          {"hotter_s", row.hotter_s},
          {"worst_c", row.worst_c},
          {"worst_line", row.worst_line},
          {"waiting_s", row.waiting_s}};
}

bool is_in_band(const TemperatureRow& row) { return row.colder_s <= 0.0 && row.hotter_s <= 0.0; }

std::string seconds_text(const TemperatureRow& row) {
  return fmt::format("{:.1f} s too cold and {:.1f} s too hot", row.colder_s, row.hotter_s);
}

}  // namespace

Json temperature_json(const std::optional<Temperature>& temperature) {
  if (!temperature) {
    return nullptr;
  }
  Json ahead = Json::array();
  for (const TemperatureAhead& one : temperature->ahead) {
    ahead.push_back(
        {{"line", one.line}, {"lead_s", one.lead_s}, {"from_c", one.from_c}, {"to_c", one.to_c}});
  }
  Json time_s = Json::array();
  Json target_c = Json::array();
  Json temperature_c = Json::array();
  for (const Temperature::Moment& moment : temperature->course) {
    time_s.push_back(moment.time_s);
    target_c.push_back(moment.target_c);
    temperature_c.push_back(moment.temperature_c);
  }
  return {{"band_c", temperature->band_c},
          {"is_known", temperature->is_known},
          {"sliced", row_json(temperature->sliced)},
          {"emitted", row_json(temperature->emitted)},
          {"ahead", std::move(ahead)},
          {"course",
           {{"time_s", std::move(time_s)},
            {"target_c", std::move(target_c)},
            {"temperature_c", std::move(temperature_c)}}}};
}

std::vector<std::string> temperature_list(const Temperature& t) {
  if (!t.is_known) {
    return {"not known, since no line of the print sets the hotend's"};
  }
  const bool always = is_in_band(t.sliced) && is_in_band(t.emitted);
  std::vector<std::string> list = {
      fmt::format("{:+.1f} °C off its target at most while filament is laid{}{}", t.emitted.worst_c,
                  t.emitted.worst_line > 0 ? fmt::format(" (line {})", t.emitted.worst_line) : "",
                  always ? fmt::format(", always within {:.3g}", t.band_c) : "")};
  if (!always) {
    list.push_back(
        fmt::format("by more than {:.3g} °C: {}{}", t.band_c, seconds_text(t.emitted),
                    t.ahead.empty() ? "" : fmt::format("; as sliced {}", seconds_text(t.sliced))));
  }
  if (!t.ahead.empty()) {
    list.push_back(
        fmt::format("{} asked for ahead",
                    t.ahead.size() == 1 ? "1 change" : fmt::format("{} changes", t.ahead.size())));
  }
  if (t.sliced.waiting_s > 0.0 || t.emitted.waiting_s > 0.0) {
    list.push_back(fmt::format("the print waits {:.0f} → {:.0f} s for it", t.sliced.waiting_s,
                               t.emitted.waiting_s));
  }
  return list;
}

std::string temperature_text(const std::optional<Temperature>& temperature) {
  return temperature ? fmt::format("temperature   {}\n",
                                   fmt::join(temperature_list(*temperature), "\n              "))
                     : std::string{};
}

std::string temperature_card(const Temperature& temperature) {
  Plot plot{.title = "Temperature along the print",
            .x_label = "time, s",
            .y_label = "temperature, °C",
            .width_px = 680,
            .height_px = 300};
  PlotCurve target;
  target.label = "target";
  target.colour = "--muted";
  target.stroke = Stroke::dashed;
  PlotCurve hotend;
  hotend.label = "hotend";
  hotend.colour = "--after";
  for (const Temperature::Moment& moment : temperature.course) {
    if (moment.target_c > 0.0) {
      target.points.push_back({moment.time_s, moment.target_c});
    }
    hotend.points.push_back({moment.time_s, moment.temperature_c});
  }
  plot.curves = {std::move(target), std::move(hotend)};
  const std::string figure =
      temperature.is_known ? svg_plot(plot) + svg_legend(plot) : std::string{};
  return fmt::format(
      "<section class=\"card\" aria-labelledby=\"temperature-h\">\n<h2 "
      "id=\"temperature-h\">Temperature</h2>\n<p class=\"note\">By the hotend's model, without the "
      "part fan: {}.</p>\n{}</section>\n",
      escape_html(fmt::format("{}", fmt::join(temperature_list(temperature), "; "))), figure);
}

}  // namespace unflex::report
