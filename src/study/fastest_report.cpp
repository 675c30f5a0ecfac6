// How fast a print may go: for people and for programs.
#include <fmt/format.h>

#include <iterator>
#include <string>

#include "unflex/report/format.hpp"
#include "unflex/report/json_parts.hpp"
#include "unflex/rivals/klipper_calibration.hpp"
#include "unflex/study/fastest.hpp"

namespace unflex::study {
namespace {

using report::Json;
using report::micrometres_text;
using Sink = std::back_insert_iterator<std::string>;

constexpr std::string_view kAsSliced = "as sliced";

std::string rule_text(const ToleranceRule& rule) {
  if (rule.largest_times <= 1.0) {
    return "at all times";
  }
  return fmt::format("for {:g} % of the extruding time, and at most {:g} times it in the rest",
                     100.0 * ToleranceRule::kShareWithin, rule.largest_times);
}

void write_heading(Sink out, std::string_view first) {
  fmt::format_to(out, "\n{:<18}{:<12}{:>11}{:>9}{:>9}{:>11}{:>11}\n", first, "", "time, s", "mm/s²",
                 "corner", "99.9 %, µm", "max, µm");
}

void write_row(Sink out, std::string_view first, std::string_view name,
               const std::optional<TimedMotion>& motion) {
  fmt::format_to(out, "  {:<16}{:<12}", first, name);
  if (!motion) {
    fmt::format_to(out, "{:>11}\n", "—");
    return;
  }
  const std::optional<PlanLimits>& limits = motion->limits;
  fmt::format_to(out, "{:>11.2f}{:>9}{:>9}{:>11}{:>11}\n", motion->time_s,
                 limits ? fmt::format("{:.0f}", limits->accel_mm_s2) : std::string{},
                 limits ? fmt::format("{:g}", limits->corner_mm_s) : std::string{},
                 micrometres_text(motion->errors.p999_mm), micrometres_text(motion->errors.max_mm));
}

Json motion_json(const std::string& name, const std::optional<TimedMotion>& motion) {
  Json json = {{"name", name}, {"found", motion.has_value()}};
  if (motion) {
    json["time_s"] = motion->time_s;
    json["contour_p999_mm"] = motion->errors.p999_mm;
    json["contour_max_mm"] = motion->errors.max_mm;
    if (motion->limits) {
      json["max_accel_mm_s2"] = motion->limits->accel_mm_s2;
      json["square_corner_velocity_mm_s"] = motion->limits->corner_mm_s;
    }
  }
  return json;
}

}  // namespace

std::string to_text(const FastestOutcome& outcome) {
  std::string text;
  const Sink out = std::back_inserter(text);
  fmt::format_to(out, "{}\n  {}\n  kept: contour error within the tolerance {}\n", outcome.input,
                 outcome.description, rule_text(outcome.rule));
  write_heading(out, "least time");
  for (std::size_t i = 0; i < outcome.tolerances_mm.size(); ++i) {
    std::string first = fmt::format("{:g} µm", 1e3 * outcome.tolerances_mm[i]);
    for (const FastestOfContender& contender : outcome.contenders) {
      write_row(out, first, contender.name, contender.at[i]);
      first.clear();
    }
  }
  write_heading(out, "for comparison");
  write_row(out, kAsSliced, {}, outcome.as_sliced);
  std::string_view first = "Klipper's rule";
  for (const FastestOfContender& contender : outcome.contenders) {
    if (contender.advised) {
      write_row(out, first, contender.name, contender.advised);
      first = {};
    }
  }
  fmt::format_to(out,
                 "  Klipper's rule: the acceleration at which the shaper cuts a corner by 0.12 mm, "
                 "{:g} mm/s corners\n\n{} in all\n",
                 rivals::kCalibrationCorner_mm_s, report::duration_text(outcome.wall_s));
  return text;
}

std::string to_json(const FastestOutcome& outcome) {
  Json json;
  json["schema_version"] = report::kSchemaVersion;
  json["command"] = "study";
  json["version"] = outcome.version;
  json["input"] = outcome.input;
  json["printer"] = report::settings_json(outcome.printer);
  json["rule"] = {{"share_within", ToleranceRule::kShareWithin},
                  {"largest_times", outcome.rule.largest_times}};
  json["tolerances"] = Json::array();
  for (std::size_t i = 0; i < outcome.tolerances_mm.size(); ++i) {
    Json contenders = Json::array();
    for (const FastestOfContender& contender : outcome.contenders) {
      contenders.push_back(motion_json(contender.name, contender.at[i]));
    }
    json["tolerances"].push_back(
        {{"tolerance_mm", outcome.tolerances_mm[i]}, {"contenders", std::move(contenders)}});
  }
  json["advised"] = Json::array();
  for (const FastestOfContender& contender : outcome.contenders) {
    if (contender.advised) {
      json["advised"].push_back(motion_json(contender.name, contender.advised));
    }
  }
  json["as_sliced"] = {{"time_s", outcome.as_sliced.time_s},
                       {"contour_p999_mm", outcome.as_sliced.errors.p999_mm},
                       {"contour_max_mm", outcome.as_sliced.errors.max_mm}};
  json["warnings"] = outcome.warnings;
  json["performance"] = {{"wall_s", outcome.wall_s}};
  return report::dump(json);
}

}  // namespace unflex::study
