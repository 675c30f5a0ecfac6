#include "batch_summary.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <iterator>
#include <string_view>

#include "console.hpp"
#include "unflex/core/utf8.hpp"
#include "unflex/report/format.hpp"

namespace unflex::app {
namespace {

using report::Json;

constexpr std::size_t kLeastNameColumns = 24;
constexpr std::size_t kMostNameColumns = 60;
constexpr std::string_view kNoCharacter = "\uFFFD";

bool is_xml_character(char32_t value) {
  return value == '\t' || value == '\n' || value == '\r' ||
         (value >= 0x20 && value != 0xfffe && value != 0xffff);
}

std::string_view xml_entity(char32_t value) {
  switch (value) {
    case '&':
      return "&amp;";
    case '<':
      return "&lt;";
    case '>':
      return "&gt;";
    case '"':
      return "&quot;";
    case '\t':
      return "&#9;";
    case '\n':
      return "&#10;";
    case '\r':
      return "&#13;";
    default:
      return {};
  }
}

Json totals_json(const BatchSummary& summary) {
  return {{"prints", summary.rows.size()},
          {"done", summary.count(BatchState::done)},
          {"unchanged", summary.count(BatchState::unchanged)},
          {"failed", summary.count(BatchState::failed)}};
}

Json row_json(const BatchRow& row) {
  Json json = {{"name", row.name},
               {"input", row.input},
               {"output", row.output},
               {"state", to_string(row.answer.state)},
               {"exit_code", row.answer.exit_code},
               {"wall_s", row.wall_s}};
  if (row.answer.measured) {
    json["deviation"] = to_json(row.answer.record.figures);
  }
  if (row.answer.state == BatchState::failed) {
    json["error"] = row.answer.error;
  }
  json["messages"] = row.answer.messages;
  return json;
}

bool is_failure(const BatchRow& row) {
  return row.answer.exit_code == static_cast<int>(ExitCode::deviation);
}

bool is_error(const BatchRow& row) {
  return row.answer.state == BatchState::failed && !is_failure(row);
}

std::string junit_case(const BatchRow& row) {
  std::string text = fmt::format("    <testcase classname=\"unflex\" name=\"{}\" time=\"{:.3f}\"",
                                 xml_text(row.name), row.wall_s);
  std::string said;
  for (const std::string& message : row.answer.messages) {
    said += message + "\n";
  }
  if (row.answer.state == BatchState::failed) {
    const std::string_view kind = is_failure(row) ? "failure" : "error";
    text += fmt::format(">\n      <{0} message=\"{1}\" type=\"exit code {2}\">{3}</{0}>\n", kind,
                        xml_text(row.answer.error), row.answer.exit_code, xml_text(said));
    return text + "    </testcase>\n";
  }
  return text + fmt::format(">\n      <system-out>{}</system-out>\n    </testcase>\n",
                            xml_text(fmt::format("{}: {}\n{}", to_string(row.answer.state),
                                                 result_text(row.answer), said)));
}

}  // namespace

std::size_t BatchSummary::count(BatchState state) const {
  return static_cast<std::size_t>(
      std::ranges::count(rows, state, [](const BatchRow& row) { return row.answer.state; }));
}

int BatchSummary::exit_code() const {
  int worst = 0;
  for (const BatchRow& row : rows) {
    worst = std::max(worst, row.answer.exit_code);
  }
  return worst;
}

std::string result_text(const BatchAnswer& answer) {
  if (answer.state == BatchState::failed) {
    return answer.error;
  }
  const BatchFigures& figures = answer.record.figures;
  return fmt::format("{} → {} µm max, {} → {} µm RMS",
                     report::micrometres_text(figures.max_before_mm),
                     report::micrometres_text(figures.max_after_mm),
                     report::micrometres_text(figures.rms_before_mm),
                     report::micrometres_text(figures.rms_after_mm));
}

std::string total_text(const BatchSummary& summary) {
  return fmt::format("{} print{}: {} done, {} unchanged, {} failed, in {}", summary.rows.size(),
                     summary.rows.size() == 1 ? "" : "s", summary.count(BatchState::done),
                     summary.count(BatchState::unchanged), summary.count(BatchState::failed),
                     report::duration_text(summary.wall_s));
}

std::string summary_table(const BatchSummary& summary) {
  std::size_t columns = kLeastNameColumns;
  for (const BatchRow& row : summary.rows) {
    columns = std::clamp(one_line(row.name).size(), columns, kMostNameColumns);
  }
  std::string text = fmt::format("{:<{}}  {:<10}  {:>10}  {}\n", "print", columns, "result",
                                 "wall time", "deviation of extruding moves");
  for (const BatchRow& row : summary.rows) {
    text += fmt::format("{:<{}}  {:<10}  {:>10}  {}\n", one_line(row.name), columns,
                        to_string(row.answer.state), report::duration_text(row.wall_s),
                        one_line(result_text(row.answer)));
  }
  return text + total_text(summary) + "\n";
}

std::string summary_json(const BatchSummary& summary) {
  Json json;
  json["schema_version"] = report::kSchemaVersion;
  json["command"] = "batch";
  json["version"] = version();
  json["input"] = summary.input;
  json["output"] = summary.output;
  json["shard"] = summary.shard
                      ? Json(fmt::format("{}/{}", summary.shard->number, summary.shard->count))
                      : Json();
  json["exit_code"] = summary.exit_code();
  json["wall_s"] = summary.wall_s;
  json["totals"] = totals_json(summary);
  json["prints"] = Json::array();
  for (const BatchRow& row : summary.rows) {
    json["prints"].push_back(row_json(row));
  }
  json["passed_by"] = summary.passed_by;
  return report::dump(json);
}

std::string summary_junit(const BatchSummary& summary) {
  const std::string counts =
      fmt::format("tests=\"{}\" failures=\"{}\" errors=\"{}\" time=\"{:.3f}\"", summary.rows.size(),
                  std::ranges::count_if(summary.rows, is_failure),
                  std::ranges::count_if(summary.rows, is_error), summary.wall_s);
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites {0}>\n"
      "  <testsuite name=\"unflex batch {1}\" {0}>\n",
      counts, xml_text(summary.input));
  for (const BatchRow& row : summary.rows) {
    text += junit_case(row);
  }
  return text + "  </testsuite>\n</testsuites>\n";
}

std::string xml_text(std::string_view text) {
  std::string xml;
  while (!text.empty()) {
    const Utf8Character character = first_utf8(text);
    const std::size_t length = std::max<std::size_t>(character.length, 1);
    const std::string_view entity = xml_entity(character.value);
    if (character.length == 0 || !is_xml_character(character.value)) {
      xml += kNoCharacter;
    } else if (!entity.empty()) {
      xml += entity;
    } else {
      xml += text.substr(0, length);
    }
    text.remove_prefix(length);
  }
  return xml;
}

}  // namespace unflex::app
