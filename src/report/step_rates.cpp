#include <fmt/core.h>

#include "unflex/report/format.hpp"
#include "unflex/report/json_parts.hpp"

namespace unflex::report {
namespace {

constexpr double kKilo = 1e-3;

Json row_json(const StepRates::Row& row, bool has_output) {
  Json json = {{"sliced_hz", row.sliced_hz}, {"sliced_line", row.sliced_line}};
  if (has_output) {
    json["emitted_hz"] = row.emitted_hz;
    json["emitted_line"] = row.emitted_line;
  }
  return json;
}

}  // namespace

Json step_rates_json(const StepRates& rates, bool has_output) {
  if (rates.motors.empty()) {
    return nullptr;
  }
  Json motors = Json::array();
  for (const StepRates::Row& row : rates.motors) {
    Json json = {{"motor", row.motor}, {"steps_per_mm", row.steps_per_mm}};
    json.update(row_json(row, has_output));
    motors.push_back(std::move(json));
  }
  // A limit that is not finite is written as null.
  return {{"motors", std::move(motors)},
          {"total", row_json(rates.total, has_output)},
          {"max_hz", rates.max_hz},
          {"max_total_hz", rates.max_total_hz},
          {"max_shared_hz", rates.max_shared_hz}};
}

std::string step_rates_list(const StepRates& rates, bool has_output) {
  std::string text;
  for (const StepRates::Row& row : rates.motors) {
    text += fmt::format("{}{} {:.1f}", &row == &rates.motors.front() ? "" : ", ", row.motor,
                        kKilo * row.sliced_hz);
    const std::size_t line = has_output ? row.emitted_line : row.sliced_line;
    text += has_output ? fmt::format(" → {:.1f}", kKilo * row.emitted_hz) : "";
    text += line > 0 ? fmt::format(" (line {})", line) : "";
  }
  text += " kHz at most";
  text += rates.max_hz < std::numeric_limits<double>::infinity()
              ? fmt::format("; {:.1f} allowed", kKilo * rates.max_hz)
              : "";
  return text;
}

std::string step_rates_text(const StepRates& rates, bool has_output) {
  return rates.motors.empty()
             ? std::string{}
             : fmt::format("step rates    {}\n", step_rates_list(rates, has_output));
}

}  // namespace unflex::report
