// Parts shared by the reports of several studies. Outcomes have version, input, printer and
// warnings.
#pragma once

#include <fmt/format.h>

#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "unflex/report/format.hpp"
#include "unflex/report/html_page.hpp"
#include "unflex/report/json_parts.hpp"

namespace unflex::study {

// The beginning of a report of a print.
template <class Outcome>
[[nodiscard]] report::Json head_json(const Outcome& outcome) {
  report::Json json;
  json["schema_version"] = report::kSchemaVersion;
  json["command"] = "study";
  json["version"] = outcome.version;
  json["input"] = outcome.input;
  json["printer"] = report::settings_json(outcome.printer);
  return json;
}

// Few digits, as a time differs from one run of the program to the next.
[[nodiscard]] inline std::string milliseconds_text(double time_s) {
  const double ms = time_s * 1e3;
  return fmt::format("{:.{}f}", ms, ms < 9.995 ? 2 : 0);
}

inline void write_warnings(std::back_insert_iterator<std::string> out,
                           const std::vector<std::string>& warnings) {
  if (warnings.empty()) {
    return;
  }
  fmt::format_to(out, "<section class=\"card\"><h2>Warnings</h2><ul>\n");
  for (const std::string& warning : warnings) {
    fmt::format_to(out, "<li>{}</li>\n", report::escape_html(warning));
  }
  fmt::format_to(out, "</ul></section>\n");
}

// The makers, as "unflex" and its version, and the printer's settings.
inline void write_settings(std::back_insert_iterator<std::string> out,
                           const std::vector<std::pair<std::string_view, std::string_view>>& makers,
                           const std::vector<report::Setting>& printer) {
  fmt::format_to(out, "<section class=\"card\"><h2>How it was made</h2><dl class=\"facts\">");
  for (const auto& [name, value] : makers) {
    fmt::format_to(out, "<dt>{}</dt><dd>{}</dd>", name, report::escape_html(value));
  }
  for (const report::Setting& setting : printer) {
    fmt::format_to(out, "<dt>{}</dt><dd>{} <span class=\"note\">{}</span></dd>\n",
                   report::escape_html(setting.key), report::escape_html(setting.value),
                   report::escape_html(setting.origin));
  }
  fmt::format_to(out, "</dl></section>\n");
}

}  // namespace unflex::study
