#include "batch_result.hpp"

#include <type_traits>
#include <utility>

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

namespace {

// Takes what an object has under a key, if it is of the right kind.
template <class Value>
bool take(const Json& object, const char* key, Value& value) {
  const auto found = object.find(key);
  if (found == object.end()) {
    return false;
  }
  if constexpr (std::is_same_v<Value, std::string>) {
    if (!found->is_string()) {
      return false;
    }
  } else if constexpr (std::is_same_v<Value, bool>) {
    if (!found->is_boolean()) {
      return false;
    }
  } else if constexpr (std::is_arithmetic_v<Value>) {
    if (!found->is_number()) {
      return false;
    }
  }
  value = found->get<Value>();
  return true;
}

bool take(const Json& object, const char* key, Json& value) {
  const auto found = object.find(key);
  if (found == object.end()) {
    return false;
  }
  value = *found;
  return true;
}

bool take_all(const Json& object, const char* key, std::vector<std::string>& values) {
  Json list;
  if (!take(object, key, list) || !list.is_array()) {
    return false;
  }
  for (const Json& item : list) {
    if (!item.is_string()) {
      return false;
    }
    values.push_back(item.get<std::string>());
  }
  return true;
}

// "uncompensated" and "compensated" under a key.
bool take_pair(const Json& object, const char* key, double& before, double& after) {
  Json pair;
  return take(object, key, pair) && take(pair, "uncompensated", before) &&
         take(pair, "compensated", after);
}

}  // namespace

std::optional<BatchRecord> record_from(const Json& json) {
  BatchRecord record;
  BatchOrigin& origin = record.origin;
  BatchFigures& is = record.figures;
  Json figures;
  const bool is_whole =
      take(json, "version", origin.version) && take(json, "input_sha256", origin.input_sha256) &&
      take(json, "settings_sha256", origin.settings_sha256) &&
      take(json, "output_sha256", origin.output_sha256) &&
      take(json, "report_sha256", origin.report_sha256) && take(json, "figures", figures) &&
      take_pair(figures, "contour_max_mm", is.max_before_mm, is.max_after_mm) &&
      take_pair(figures, "contour_rms_mm", is.rms_before_mm, is.rms_after_mm) &&
      take(figures, "print_time_s", is.print_time_s);
  return is_whole ? std::optional(std::move(record)) : std::nullopt;
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
  const Json json = Json::parse(text, nullptr, false);
  BatchAnswer answer;
  int state = 0;
  Json record;
  const bool is_whole = take(json, "state", state) && take(json, "exit_code", answer.exit_code) &&
                        take(json, "measured", answer.measured) && take(json, "record", record) &&
                        take_all(json, "messages", answer.messages) &&
                        take(json, "error", answer.error);
  const std::optional<BatchRecord> known = is_whole ? record_from(record) : std::nullopt;
  if (!known) {
    return {};
  }
  answer.state = static_cast<BatchState>(state);
  answer.record = *known;
  return answer;
}

}  // namespace unflex::app
