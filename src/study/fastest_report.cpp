// How fast a print may go: for people and for programs.
#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <optional>
#include <string>

#include "fastest_words.hpp"
#include "report_parts.hpp"
#include "unflex/report/format.hpp"
#include "unflex/report/json_parts.hpp"
#include "unflex/rivals/klipper_calibration.hpp"
#include "unflex/study/fastest.hpp"

namespace unflex::study {
namespace {

using report::Json;
using report::micrometres_text;
using Sink = std::back_insert_iterator<std::string>;

// The least times: a row for each contender, a column for each tolerance.
void write_times(Sink out, const FastestOutcome& outcome) {
  fmt::format_to(out, "\n{:<18}", "print time, s");
  for (const double tolerance_mm : outcome.tolerances_mm) {
    fmt::format_to(out, "{:>10}", fmt::format("{:g} µm", 1e3 * tolerance_mm));
  }
  const auto write = [&](std::string_view name, const auto& cell) {
    fmt::format_to(out, "\n  {:<16}", name);
    for (std::size_t i = 0; i < outcome.tolerances_mm.size(); ++i) {
      fmt::format_to(out, "{:>10}", cell(i));
    }
  };
  for (const FastestOfContender& contender : outcome.contenders) {
    write(contender.name, [&](std::size_t i) {
      return contender.at[i] ? time_text(contender.at[i]->time_s) : std::string("—");
    });
  }
  write(kAtFeed, [&](std::size_t) { return time_text(outcome.at_feed_s); });
  write("unflex saves", [&](std::size_t i) { return saving_text(outcome, i); });
  fmt::format_to(out, "\n  saves: of the time of the best other\n");
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

std::string rule_text(const ToleranceRule& rule) {
  if (rule.largest_times <= 1.0) {
    return "at all times";
  }
  return fmt::format("for {:g} % of the extruding time, and at most {:g} times it in the rest",
                     100.0 * ToleranceRule::kShareWithin, rule.largest_times);
}

std::string tuning_text(const FastestOutcome& outcome) {
  return outcome.freq_error > 0.0
             ? fmt::format("made for the exact frequencies, but unflex for up to {:.3g} % off",
                           100.0 * outcome.freq_error)
             : std::string("all made for the exact frequencies");
}

std::string time_text(double time_s) {
  if (time_s < 59.995) {
    return fmt::format("{:.2f}", time_s);
  }
  const auto tenths = static_cast<long>(std::lround(10.0 * time_s));
  return fmt::format("{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10);
}

std::string saving_text(const FastestOutcome& outcome, std::size_t tolerance) {
  const std::optional<double> share = outcome.unflex_saves(tolerance);
  if (!share) {
    return "—";
  }
  // Two figures.
  const double percent = 100.0 * *share;
  return fmt::format("{:.{}f} %", percent, std::abs(percent) < 9.95 ? 1 : 0);
}

std::string to_text(const FastestOutcome& outcome) {
  std::string text;
  const Sink out = std::back_inserter(text);
  fmt::format_to(out, "{}\n  {}\n  kept: contour error within the tolerance {}\n  {}\n",
                 outcome.input, outcome.description, rule_text(outcome.rule), tuning_text(outcome));
  write_times(out, outcome);
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
  Json json = head_json(outcome);
  json["rule"] = {{"share_within", ToleranceRule::kShareWithin},
                  {"largest_times", outcome.rule.largest_times}};
  json["freq_error"] = outcome.freq_error;
  json["tolerances"] = Json::array();
  for (std::size_t i = 0; i < outcome.tolerances_mm.size(); ++i) {
    Json contenders = Json::array();
    for (const FastestOfContender& contender : outcome.contenders) {
      contenders.push_back(motion_json(contender.name, contender.at[i]));
    }
    const std::optional<double> saves = outcome.unflex_saves(i);
    json["tolerances"].push_back({{"tolerance_mm", outcome.tolerances_mm[i]},
                                  {"contenders", std::move(contenders)},
                                  {"unflex_saves", saves ? Json(*saves) : Json(nullptr)}});
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
  json["always_at_f"] = {{"time_s", outcome.at_feed_s}};
  json["warnings"] = outcome.warnings;
  json["performance"] = {{"wall_s", outcome.wall_s}};
  return report::dump(json);
}

}  // namespace unflex::study
