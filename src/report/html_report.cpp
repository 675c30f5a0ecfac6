// Without its script the page lacks only the pictures. The script reads what it shows from one JSON
// object and the bytes of the paths.
#include <fmt/core.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "answers.hpp"
#include "assets.hpp"
#include "facts.hpp"
#include "places_card.hpp"
#include "temperature_card.hpp"
#include "unflex/core/base64.hpp"
#include "unflex/report/format.hpp"
#include "unflex/report/html_page.hpp"
#include "unflex/report/report.hpp"

namespace unflex::report {
namespace {

double um(double mm) { return std::round(mm * 1e6) / 1000.0; }
double rounded(double value, double unit) { return std::round(value / unit) * unit; }

Json spread_json(const Spread& spread) { return {um(spread.max_mm), um(spread.rms_mm)}; }

Json change_json(const BeforeAfter& change) {
  return {spread_json(change.before), spread_json(change.after)};
}

Json row_json(const verify::DeviationStats& row) {
  return {{"max", um(row.contour_max_mm)},
          {"p99", um(row.contour_p99_mm)},
          {"rms", um(row.contour_rms_mm)},
          {"line", row.contour_max_line}};
}

Json layers_json(const std::vector<LayerRow>& layers) {
  Json array = Json::array();
  for (const LayerRow& layer : layers) {
    array.push_back({rounded(layer.z_mm, 0.001), layer.first_line, layer.paths_end,
                     um(layer.spread.before.max_mm), um(layer.spread.before.rms_mm),
                     um(layer.spread.after.max_mm), um(layer.spread.after.rms_mm)});
  }
  return array;
}

Json features_json(const std::vector<FeatureRow>& features) {
  Json array = Json::array();
  for (const FeatureRow& feature : features) {
    array.push_back({{"name", feature.name},
                     {"time", rounded(feature.duration_s, 0.1)},
                     {"change", change_json(feature.spread)}});
  }
  return array;
}

void append_float(double value, std::string& bytes) {
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(value));
  for (unsigned shift = 0; shift < 32; shift += 8) {
    bytes += static_cast<char>(bits >> shift & 0xFFU);
  }
}

// The moments as little-endian floats: eight per moment, in the order of its fields.
std::string packed(const std::vector<Moment>& moments) {
  std::string bytes;
  for (const Moment& m : moments) {
    for (const double value : {m.time_s, m.contour_mm, m.reference_mm.x, m.reference_mm.y,
                               m.base_mm.x, m.base_mm.y, m.nozzle_mm.x, m.nozzle_mm.y}) {
      append_float(value, bytes);
    }
  }
  return to_base64(bytes);
}

Json places_json(const std::vector<Place>& places) {
  Json array = Json::array();
  for (const Place& place : places) {
    array.push_back({{"line", place.line},
                     {"layer", place.layer},
                     {"feature", place.feature},
                     {"at",
                      {rounded(place.xy_mm.x, 0.001), rounded(place.xy_mm.y, 0.001),
                       rounded(place.z_mm, 0.001)}},
                     {"um", {um(place.before_mm), um(place.after_mm)}},
                     {"moments", {packed(place.before), packed(place.after)}}});
  }
  return array;
}

Json histogram_json(const std::vector<HistogramCell>& cells) {
  Json array = Json::array();
  for (const HistogramCell& cell : cells) {
    array.push_back({rounded(cell.from_mm * 1e3, 1e-5), rounded(cell.before_s, 1e-3),
                     rounded(cell.after_s, 1e-3)});
  }
  return array;
}

Json contenders_json(const std::vector<Contender>& contenders) {
  Json array = Json::array();
  for (const Contender& contender : contenders) {
    Json spreads = Json::array();
    for (const Spread& spread : contender.spreads) {
      spreads.push_back(spread_json(spread));
    }
    array.push_back(
        {{"name", contender.name},
         {"spreads", spreads},
         {"drawn", contender.drawn},
         {"printers", contender.printers_own},
         {"corners", contender.corner_rms_mm ? Json(rounded(*contender.corner_rms_mm * 1e3, 1e-3))
                                             : Json(nullptr)}});
  }
  return array;
}

Json listed(const std::vector<std::string>& texts) {
  Json array = Json::array();
  for (const std::string& text : texts) {
    if (array.size() < kMostListed) {
      array.push_back(text.substr(0, kLongestText));
    }
  }
  return array;
}

Json remarks_json(const Report& r) {
  Json fallbacks = Json::array();
  for (const Fallback& kept : r.runs.fallbacks) {
    if (fallbacks.size() < kMostListed) {
      fallbacks.push_back({kept.first_line, kept.last_line, kept.reason});
    }
  }
  return {{"violations", listed(r.violations)},
          {"violation_count", r.violation_count},
          {"warnings", listed(r.warnings)},
          {"warning_count", r.warnings.size()},
          {"fallbacks", fallbacks},
          {"fallback_count", r.runs.fallback},
          {"kept_moves", Json(r.runs.kept_moves)}};
}

Json data_json(const Report& r) {
  const Recording& recording = *r.recording;
  Json settings = Json::array();
  for (const Setting& setting : r.printer) {
    settings.push_back({setting.key, setting_text(setting.value), setting.origin});
  }
  return {
      {"deviation",
       {row_json(r.measured.uncompensated.extruding), row_json(r.measured.compensated.extruding)}},
      {"layers", layers_json(recording.layers)},
      {"start_layers", recording.start_layers},
      {"layer_step", recording.paths.layer_step},
      {"tolerance_mm", recording.paths.tolerance_mm},
      {"frame",
       {recording.paths.min_mm.x, recording.paths.min_mm.y, recording.paths.max_mm.x,
        recording.paths.max_mm.y}},
      {"features", features_json(recording.features)},
      {"worst", {places_json(recording.worst_before), places_json(recording.worst_after)}},
      {"histogram", histogram_json(recording.histogram)},
      {"frequency_errors", recording.frequency_errors},
      {"freq_error", r.others.freq_error},
      {"contenders", contenders_json(recording.contenders)},
      {"extruding_s", rounded(r.measured.uncompensated.extruding.duration_s, 0.1)},
      {"shapers_s", rounded(recording.shapers_measured_s, 0.1)},
      {"remarks", remarks_json(r)},
      {"facts", facts_json(r)},
      {"settings", settings}};
}

constexpr std::string_view kTypical =
    "Root mean square, over the time in which filament is laid, of the distance between nozzle and "
    "sliced path. It is computed: the file is replayed as the firmware would, with the nozzle "
    "hanging on springs and dampers of the frequencies given in the settings.";

constexpr std::string_view kTypicalEdge =
    "Root mean square, over the way on which filament is laid, of how far the edges of the line of "
    "plastic are off: the distance of the nozzle from the sliced path, and half of what the line "
    "is too wide or too narrow. It is computed: the file is replayed as the firmware would, with "
    "the "
    "nozzle hanging on springs and dampers, and filament pressed together in the hotend.";

// A length with three figures, in µm.
std::string um_text(double mm) {
  const double value = mm * 1e3;
  const int digits = value >= 99.95 ? 0 : value >= 9.995 ? 1 : 2;
  return fmt::format("{:.{}f} µm", value, digits);
}

std::string key_figure(std::string_view name, std::string_view explanation,
                       const std::string& before, const std::string& after,
                       const std::string& note) {
  return fmt::format(
      R"(<div><dt>{}</dt><dd><span class="before">{}</span> → <span class="after">{}</span> <small>{}</small></dd></div>
)",
      term(name, explanation), escape_html(before), escape_html(after), escape_html(note));
}

std::string times_less(double before, double after) {
  if (!(after > 0.0) || before < 1.05 * after) {
    return "";
  }
  const double factor = before / after;
  return fmt::format("{:.{}f}× less", factor, factor >= 9.95 ? 0 : 1);
}

// One of the three answers: its question, what it says in short, and lines below that.
std::string answer(std::string_view question, const std::string& short_answer,
                   const std::vector<std::string>& lines) {
  std::string html = fmt::format("<div class=\"answer\"><h2>{}</h2>\n<p class=\"short\">{}</p>\n",
                                 question, short_answer);
  for (const std::string& line : lines) {
    html += fmt::format("<p>{}</p>\n", line);
  }
  return html + "</div>\n";
}

std::string change(double from_mm, double to_mm) {
  return fmt::format(R"(<b class="before">{}</b> → <b class="after">{}</b>)",
                     micrometres_text(from_mm), um_text(to_mm));
}

std::string better_answer(const Report& r) {
  const Better found = better(r);
  const std::vector<std::string> faster = faster_texts(r);
  const bool is_allowed = !faster.empty() && found.times() < 1.0;
  const std::string from_path =
      change(found.exact.now_mm, found.exact.compensated_mm) + " off the path";
  std::string explanation(kTypical);
  std::string headline = from_path;
  std::vector<std::string> lines;
  if (found.edge) {
    explanation = kTypicalEdge;
    headline = change(found.edge->now_mm, found.edge->compensated_mm) + " at the edges of the line";
    const std::string edge_times = times_text(times_smaller(*found.edge));
    const std::string times = is_allowed ? "" : ": " + times_text(found.times());
    lines = {escape_html(fmt::format("{}, {}.", edge_times, found.now)),
             escape_html(width_text(r) + "."), "The nozzle is " + from_path + times + "."};
  } else {
    const std::string times = is_allowed ? "Now" : times_text(found.times()) + ",";
    lines = {escape_html(fmt::format("{} {}.", times, found.now)),
             escape_html(width_text(r) + ".")};
  }
  if (found.off) {
    lines.push_back(fmt::format("{} if the frequencies are 5 % off.",
                                change(found.off->now_mm, found.off->compensated_mm)));
  }
  if (found.exact.zv_mm) {
    lines.push_back(fmt::format(
        "A ZV shaper would leave {}{}.", um_text(*found.exact.zv_mm),
        found.off && found.off->zv_mm
            ? fmt::format(", {} if they are 5 % off", micrometres_text(*found.off->zv_mm))
            : std::string{}));
  }
  if (const std::optional<std::string> text = hardly_worth_it(r)) {
    lines.push_back(escape_html(*text) + ".");
  }
  for (std::size_t i = 0; i < faster.size(); ++i) {
    lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(i), escape_html(faster[i]) + ".");
  }
  return answer(term("Better?", explanation), headline, lines);
}

std::string worst_answer(const Report& r) {
  const Worst found = worst(r);
  std::vector<std::string> lines;
  std::string headline = "nowhere";
  if (found.compensated) {
    headline = fmt::format("<b class=\"after\">{}</b>", um_text(found.compensated->after_mm));
    lines.push_back(fmt::format("In <a href=\"#worst\">{}</a>.",
                                escape_html(place_text(*r.recording, *found.compensated))));
  }
  if (found.now) {
    lines.push_back(fmt::format("Now <b class=\"before\">{}</b> in {}.",
                                um_text(found.now->before_mm),
                                escape_html(place_text(*r.recording, *found.now))));
  }
  if (found.start) {
    lines.push_back(fmt::format("Before the first layer {}.",
                                change(found.start->before.max_mm, found.start->after.max_mm)));
  }
  return answer(term("Where is it worst?",
                     "The greatest distance of the nozzle from the sliced path while filament is "
                     "laid. Lines that prime the nozzle before the first layer are left out."),
                headline, lines);
}

std::string safe_answer(const Report& r) {
  const Safe found = safe(r);
  std::vector<std::string> lines;
  for (const std::string& reason : found.reasons) {
    lines.push_back(escape_html(reason));
  }
  return answer("Is it safe?",
                found.is_safe
                    ? "<b class=\"after\">yes</b>, every rule is kept"
                    : "<b class=\"before\">no</b>, <a href=\"#remarks\">do not print it</a>",
                lines);
}

std::string made_for(const Report& r) {
  std::string html =
      fmt::format("<p class=\"made-for\">Made for {}.", escape_html(made_for_text(r)));
  if (!r.warnings.empty()) {
    html += fmt::format(" <a href=\"#remarks\">{} {}</a>, the first: {}", r.warnings.size(),
                        r.warnings.size() == 1 ? "warning" : "warnings",
                        escape_html(r.warnings.front().substr(0, kLongestText)));
  }
  return html + "</p>\n";
}

std::string key_figures(const Report& r) {
  const verify::DeviationStats& before = r.measured.uncompensated.extruding;
  const verify::DeviationStats& after = r.measured.compensated.extruding;
  const auto figure = [](std::string_view name, std::string_view explanation, double from_mm,
                         double to_mm) {
    return key_figure(name, explanation, um_text(from_mm), um_text(to_mm),
                      times_less(from_mm, to_mm));
  };
  const double change =
      r.measured.uncompensated.time_s > 0.0
          ? 100.0 * (r.measured.compensated.time_s / r.measured.uncompensated.time_s - 1.0)
          : 0.0;
  std::string html = R"(<dl class="key-figures">)";
  html += figure("99 % of the time below",
                 "Only during one hundredth of the extruding time is the nozzle further from its "
                 "path than this.",
                 before.contour_p99_mm, after.contour_p99_mm);
  if (r.measured.uncompensated.corners.count > 0) {
    html += figure("Typical corner",
                   "How far the nozzle passes from the corners of the path: the root mean square "
                   "over all places where an extruding path turns by more than 20°.",
                   r.measured.uncompensated.corners.rms_mm, r.measured.compensated.corners.rms_mm);
  }
  html +=
      key_figure("Print time", "As the firmware's planner makes it, heating and macros excluded.",
                 duration_text(r.measured.uncompensated.time_s),
                 duration_text(r.measured.compensated.time_s), fmt::format("{:+.2f} %", change));
  return html + "</dl>";
}

std::string hero(const Report& r) {
  return "<section class=\"card hero\" aria-label=\"Result\">\n<div class=\"answers\">\n" +
         better_answer(r) + worst_answer(r) + safe_answer(r) + "</div>\n" + made_for(r) +
         key_figures(r) + "</section>\n";
}

std::string file_name(const std::string& path) {
  return path == "-" ? "standard input" : path.substr(path.find_last_of('/') + 1);
}

}  // namespace

std::string to_html(const Report& report) {
  Page page;
  page.title = file_name(report.input);
  page.style = assets::report_css;
  page.body = hero(report);
  page.body += assets::report_html;
  page.body += places_card(report.measured);
  page.body += report.temperature ? temperature_card(*report.temperature) : std::string{};
  page.body += embedded_json("data", data_json(report));
  page.body += fmt::format("<script type=\"application/octet-stream\" id=\"paths\">{}</script>\n",
                           to_base64(report.recording->paths.bytes));
  for (const std::string_view script : {assets::plot_js, assets::paths_js, assets::layers_js,
                                        assets::moment_js, assets::report_js}) {
    page.script += script;
  }
  return html_page(page);
}

}  // namespace unflex::report
