// The findings of the bench of places: for people and for programs.
#include <fmt/format.h>

#include <iterator>

#include "report_parts.hpp"
#include "unflex/study/map_bench.hpp"

namespace unflex::study {
namespace {

using report::Json;
using report::micrometres_text;

}  // namespace

std::string to_text(const MapOutcome& outcome) {
  std::string text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "{}, {:.0f} s of it\ncontour RMS, µm      X, Y     ", outcome.input,
                 outcome.measured_s);
  for (const MapContender& contender : outcome.contenders) {
    fmt::format_to(out, "{:>12}", contender.name);
  }
  fmt::format_to(out, "\n{:<30}", "  tuned to, Hz");
  for (const MapContender& contender : outcome.contenders) {
    fmt::format_to(out, "{:>12}",
                   contender.freq_hz.x > 0.0
                       ? fmt::format("{:.1f}, {:.1f}", contender.freq_hz.x, contender.freq_hz.y)
                       : std::string{});
  }
  fmt::format_to(out, "\n");
  for (std::size_t i = 0; i < outcome.places_mm.size(); ++i) {
    fmt::format_to(out, "  {:<28}",
                   fmt::format("X{:.0f} Y{:.0f}: {:.1f}, {:.1f} Hz", outcome.places_mm[i].x,
                               outcome.places_mm[i].y, outcome.freq_hz[i].x, outcome.freq_hz[i].y));
    for (const MapContender& contender : outcome.contenders) {
      fmt::format_to(out, "{:>12}", micrometres_text(contender.rms_mm[i]));
    }
    fmt::format_to(out, "\n");
  }
  fmt::format_to(out, "{:<30}", "  at the worst place");
  for (const MapContender& contender : outcome.contenders) {
    fmt::format_to(out, "{:>12}", micrometres_text(contender.worst_mm()));
  }
  const double best_mm = outcome.best_shaper().worst_mm();
  fmt::format_to(
      out, "\nAt its worst place unflex leaves {:.2f} of what the best shaper, {}, does.\n",
      best_mm > 0.0 ? outcome.unflex().worst_mm() / best_mm : 0.0, outcome.best_shaper().name);
  if (outcome.failed_runs > 0) {
    fmt::format_to(out, "{} runs without a solution, measured as sliced\n", outcome.failed_runs);
  }
  return text;
}

std::string to_json(const MapOutcome& outcome) {
  Json json = head_json(outcome);
  json["measured_s"] = outcome.measured_s;
  json["places"] = Json::array();
  for (std::size_t i = 0; i < outcome.places_mm.size(); ++i) {
    json["places"].push_back({{"x_mm", outcome.places_mm[i].x},
                              {"y_mm", outcome.places_mm[i].y},
                              {"x_freq_hz", outcome.freq_hz[i].x},
                              {"y_freq_hz", outcome.freq_hz[i].y}});
  }
  json["contenders"] = Json::array();
  for (const MapContender& contender : outcome.contenders) {
    const bool is_shaper = contender.freq_hz.x > 0.0;
    json["contenders"].push_back({{"name", contender.name},
                                  {"x_freq_hz", is_shaper ? Json(contender.freq_hz.x) : Json()},
                                  {"y_freq_hz", is_shaper ? Json(contender.freq_hz.y) : Json()},
                                  {"contour_rms_mm", contender.rms_mm},
                                  {"worst_rms_mm", contender.worst_mm()}});
  }
  json["failed_runs"] = outcome.failed_runs;
  json["warnings"] = outcome.warnings;
  return json.dump(2) + "\n";
}

}  // namespace unflex::study
