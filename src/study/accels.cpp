#include "unflex/study/accels.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <initializer_list>
#include <iterator>
#include <string_view>
#include <utility>

#include "report_parts.hpp"
#include "unflex/core/number.hpp"
#include "unflex/report/format.hpp"
#include "unflex/report/json_parts.hpp"

namespace unflex::study {
namespace {

using report::Json;
using report::micrometres_text;

std::string in_capitals(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::toupper(c); });
  return text;
}

// Multiplies the number that stands in the line from `at` on. Returns where it ends then.
std::size_t scale_number(std::string& line, std::size_t at, double ratio) {
  const std::size_t end = std::min(line.find_first_not_of("0123456789.", at), line.size());
  const std::optional<double> value = parse_number(line.substr(at, end - at));
  if (!value) {
    return end;
  }
  const std::string scaled = fmt::format("{:.10g}", *value * ratio);
  line.replace(at, end - at, scaled);
  return at + scaled.size();
}

// Multiplies the numbers behind each of these beginnings of words. The words are those in front of
// a comment.
void scale_words(std::string& line, std::initializer_list<std::string_view> beginnings,
                 double ratio) {
  for (std::size_t at = line.find_first_of(" \t"); at < line.find(';') && at < line.size();
       at = line.find_first_of(" \t", at)) {
    at = std::min(line.find_first_not_of(" \t", at), line.size());
    const std::string word = in_capitals(line.substr(at));
    for (const std::string_view beginning : beginnings) {
      if (word.starts_with(beginning)) {
        at = scale_number(line, at + beginning.size(), ratio);
        break;
      }
    }
  }
}

Json stats_json(const verify::DeviationStats& stats) {
  return {{"contour_rms_mm", stats.contour_rms_mm},
          {"contour_p99_mm", stats.contour_p99_mm},
          {"contour_max_mm", stats.contour_max_mm}};
}

}  // namespace

const AtAccel* AccelsOutcome::fastest_kept() const {
  const AtAccel* best = nullptr;
  for (const AtAccel& one : accels) {
    if (keep_rms_mm && one.compensated.contour_rms_mm <= *keep_rms_mm &&
        (!best || one.time_s < best->time_s)) {
      best = &one;
    }
  }
  return best;
}

std::string with_scaled_accels(const std::string& line, double ratio) {
  const std::size_t start = std::min(line.find_first_not_of(" \t"), line.size());
  const std::string command =
      in_capitals(line.substr(start, line.find_first_of(" \t;\r", start) - start));
  // Blanks in front of the command would end its first word.
  std::string rest = line.substr(start);
  if (command == "M204") {
    scale_words(rest, {"S", "P", "T"}, ratio);
  } else if (command == "SET_VELOCITY_LIMIT") {
    scale_words(rest, {"ACCEL=", "ACCEL_TO_DECEL="}, ratio);
  }
  return line.substr(0, start) + rest;
}

std::string to_text(const AccelsOutcome& outcome) {
  std::string text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "{}{}\n\n{:>9}{:>28}{:>36}\n{:>9}{:>10}", outcome.input,
                 outcome.scaled ? ", its own accelerations scaled" : "", "", "as sliced, µm",
                 "compensated, µm", "mm/s²", "time, s");
  for (int side = 0; side < 2; ++side) {
    fmt::format_to(out, "{}{:>9}{:>9}{:>9}", side == 0 ? "" : "   time, s", "RMS", "p99", "max");
  }
  for (const AtAccel& one : outcome.accels) {
    fmt::format_to(out, "\n{:>9g}", one.accel_mm_s2);
    for (const auto& [time_s, stats] :
         {std::pair(one.sliced_time_s, &one.sliced), std::pair(one.time_s, &one.compensated)}) {
      fmt::format_to(
          out, "{:>10.2f}{:>9}{:>9}{:>9}", time_s, micrometres_text(stats->contour_rms_mm),
          micrometres_text(stats->contour_p99_mm), micrometres_text(stats->contour_max_mm));
    }
  }
  fmt::format_to(out, "\n\n");
  if (outcome.keep_rms_mm) {
    const AtAccel* const kept = outcome.fastest_kept();
    fmt::format_to(out, "RMS of {} µm: {}\n", micrometres_text(*outcome.keep_rms_mm),
                   kept ? fmt::format("kept fastest at {:g} mm/s², in {:.2f} s", kept->accel_mm_s2,
                                      kept->time_s)
                        : "none of them keeps it");
  }
  fmt::format_to(out, "{} in all\n", report::duration_text(outcome.wall_s));
  return text;
}

std::string to_json(const AccelsOutcome& outcome) {
  Json json = head_json(outcome);
  json["scaled"] = outcome.scaled;
  json["accels"] = Json::array();
  for (const AtAccel& one : outcome.accels) {
    json["accels"].push_back({{"max_accel_mm_s2", one.accel_mm_s2},
                              {"sliced_time_s", one.sliced_time_s},
                              {"time_s", one.time_s},
                              {"sliced", stats_json(one.sliced)},
                              {"compensated", stats_json(one.compensated)}});
  }
  const AtAccel* const kept = outcome.fastest_kept();
  json["keep_rms_mm"] = outcome.keep_rms_mm ? Json(*outcome.keep_rms_mm) : Json(nullptr);
  json["kept_max_accel_mm_s2"] = kept ? Json(kept->accel_mm_s2) : Json(nullptr);
  json["warnings"] = outcome.warnings;
  json["performance"] = {{"wall_s", outcome.wall_s}};
  return report::dump(json);
}

}  // namespace unflex::study
