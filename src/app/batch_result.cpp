#include "batch_result.hpp"

namespace unflex::app {

using report::Json;

std::string_view to_string(BatchState state) {
  switch (state) {
    case BatchState::done:
      return "done";
    case BatchState::unchanged:
      return "unchanged";
    case BatchState::failed:
      break;
  }
  return "failed";
}

Json to_json(const BatchFigures& figures) {
  return {{"contour_max_mm",
           {{"uncompensated", figures.max_before_mm}, {"compensated", figures.max_after_mm}}},
          {"contour_rms_mm",
           {{"uncompensated", figures.rms_before_mm}, {"compensated", figures.rms_after_mm}}},
          {"print_time_s", figures.print_time_s}};
}

Json to_json(const BatchRecord& record) {
  return {{"version", record.origin.version},
          {"input_sha256", record.origin.input_sha256},
          {"settings_sha256", record.origin.settings_sha256},
          {"output_sha256", record.origin.output_sha256},
          {"report_sha256", record.origin.report_sha256},
          {"figures", to_json(record.figures)}};
}

BatchRecord record_from(const Json& json) {
  const Json& figures = json.at("figures");
  const Json& max = figures.at("contour_max_mm");
  const Json& rms = figures.at("contour_rms_mm");
  return {.origin = {.version = json.at("version"),
                     .input_sha256 = json.at("input_sha256"),
                     .settings_sha256 = json.at("settings_sha256"),
                     .output_sha256 = json.at("output_sha256"),
                     .report_sha256 = json.at("report_sha256")},
          .figures = {.max_before_mm = max.at("uncompensated"),
                      .max_after_mm = max.at("compensated"),
                      .rms_before_mm = rms.at("uncompensated"),
                      .rms_after_mm = rms.at("compensated"),
                      .print_time_s = figures.at("print_time_s")}};
}

std::string pack(const BatchAnswer& answer) {
  return report::dump({{"state", static_cast<int>(answer.state)},
                       {"exit_code", answer.exit_code},
                       {"measured", answer.measured},
                       {"record", to_json(answer.record)},
                       {"messages", answer.messages},
                       {"error", answer.error}});
}

BatchAnswer unpack(const std::string& text) {
  try {
    const Json json = Json::parse(text);
    return {.state = static_cast<BatchState>(json.at("state").get<int>()),
            .exit_code = json.at("exit_code"),
            .measured = json.at("measured"),
            .record = record_from(json.at("record")),
            .messages = json.at("messages"),
            .error = json.at("error")};
  } catch (const Json::exception&) {
    return {};
  }
}

}  // namespace unflex::app
