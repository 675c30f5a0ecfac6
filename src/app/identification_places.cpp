#include "identification_places.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <cmath>
#include <vector>

#include "identification_parts.hpp"
#include "unflex/report/html_page.hpp"

namespace unflex::app {
namespace {

using identify::AxisOverPlaces;
using identify::MapAlong;
using identify::PlaceOfAxis;
using report::Json;

// "[45.00, 42.75, 40.50]".
std::string list_hz(const std::vector<double>& freq_hz) {
  std::string text;
  for (const double hz : freq_hz) {
    text += fmt::format("{}{:.2f}", text.empty() ? "" : ", ", hz);
  }
  return "[" + text + "]";
}

std::string list_mm(const std::vector<double>& at_mm) {
  return fmt::format("[{}]", fmt::join(at_mm, ", "));
}

// "0.4 % at 100, 50, 20 mm".
std::string worst_text(const AxisOverPlaces& all) {
  const PlaceOfAxis& worst = all.worst();
  return fmt::format("{:.1f} % at {}", 100.0 * std::abs(worst.residual()),
                     identify::place_text(worst.place_mm));
}

// What there is to say below a table of places.
std::vector<std::string> remarks(const AxisOverPlaces& all) {
  std::vector<std::string> lines;
  if (!all.maps.empty()) {
    lines.push_back(fmt::format("largest difference from the maps: {}", worst_text(all)));
  }
  if (!all.remark.empty()) {
    lines.push_back(all.remark);
  }
  return lines;
}

}  // namespace

Json estimate_json(const identify::Estimate& e) {
  return {{"value", e.value}, {"low", e.low}, {"high", e.high}};
}

std::string maps_text(identify::Axis axis, const AxisOverPlaces& all) {
  std::string text;
  for (const MapAlong& map : all.maps) {
    text += fmt::format("\n[[dynamics.{}.map]]\nalong = \"{}\"\nat_mm = {}\nfreq_hz = {}\n",
                        letter(axis), map.along, list_mm(map.at_mm), list_hz(map.freq_hz));
  }
  return text;
}

std::string maps_value(const AxisOverPlaces& all) {
  std::string text;
  for (const MapAlong& map : all.maps) {
    text += fmt::format("{}{{along = \"{}\", at_mm = {}, freq_hz = {}}}", text.empty() ? "" : ", ",
                        map.along, list_mm(map.at_mm), list_hz(map.freq_hz));
  }
  return "[" + text + "]";
}

std::string places_text(identify::Axis axis, const AxisOverPlaces& all) {
  std::string text =
      fmt::format("along {}, place by place:\n  {:<20} {:<25} {:<25} {}\n", letter(axis), "place",
                  "measured, Hz", "ζ", all.maps.empty() ? "one for all, Hz" : "maps, Hz");
  for (const PlaceOfAxis& one : all.places) {
    const auto measured = [](const identify::Estimate& e) {
      return fmt::format("{} ({})", estimate_text(e), interval_text(e));
    };
    text += fmt::format("  {:<20} {:<25} {:<25} {:.2f}\n", identify::place_text(one.place_mm),
                        measured(one.freq_hz), measured(one.damping_ratio), one.map_hz);
  }
  for (const std::string& line : remarks(all)) {
    text += "  " + line + "\n";
  }
  return text;
}

std::string places_html(identify::Axis axis, const AxisOverPlaces& all) {
  std::string rows;
  for (const PlaceOfAxis& one : all.places) {
    rows += fmt::format(
        "<tr><td>{}</td><td>{} Hz ({})</td><td>{} ({})</td><td>{:.2f} Hz</td></tr>\n",
        identify::place_text(one.place_mm), estimate_text(one.freq_hz), interval_text(one.freq_hz),
        estimate_text(one.damping_ratio), interval_text(one.damping_ratio), one.map_hz);
  }
  std::string notes;
  for (const std::string& line : remarks(all)) {
    notes += fmt::format("<p class=\"note\">{}</p>\n", report::escape_html(line));
  }
  return fmt::format(
      "<div class=\"scroll\"><table class=\"data\"><thead><tr><th>place, along {}</th>"
      "<th>frequency (95 %)</th><th>damping ratio (95 %)</th><th>{}</th></tr></thead><tbody>\n{}"
      "</tbody></table></div>\n{}",
      letter(axis), all.maps.empty() ? "one for all" : "maps", rows, notes);
}

void add_places(const AxisOverPlaces& all, Json& axis) {
  axis["maps"] = Json::array();
  for (const MapAlong& map : all.maps) {
    axis["maps"].push_back(
        {{"along", std::string(1, map.along)}, {"at_mm", map.at_mm}, {"freq_hz", map.freq_hz}});
  }
  axis["places"] = Json::array();
  for (const PlaceOfAxis& one : all.places) {
    axis["places"].push_back({{"place_mm", one.place_mm},
                              {"records", one.records},
                              {"freq_hz", estimate_json(one.freq_hz)},
                              {"damping_ratio", estimate_json(one.damping_ratio)},
                              {"map_hz", one.map_hz}});
  }
  axis["reference_mm"] = all.reference_mm;
  axis["largest_residual"] = std::abs(all.worst().residual());
  axis["remark"] = all.remark;
}

}  // namespace unflex::app
