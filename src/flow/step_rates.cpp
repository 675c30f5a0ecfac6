#include "step_rates.hpp"

#include <fmt/core.h>

#include <cstddef>

#include "unflex/core/error.hpp"

namespace unflex::flow {
namespace {

report::StepRates::Row row(const verify::StepRate& sliced, const verify::StepRate* emitted) {
  report::StepRates::Row result;
  result.sliced_hz = sliced.hz;
  result.sliced_line = sliced.line;
  if (emitted != nullptr) {
    result.emitted_hz = emitted->hz;
    result.emitted_line = emitted->line;
  }
  return result;
}

}  // namespace

void add_step_limits(const machine::Settings& settings, report::StepRates& rates) {
  const machine::StepLimits limits = settings.step_limits();
  rates.max_hz = limits.max_hz;
  rates.max_total_hz = limits.max_total_hz;
  rates.max_shared_hz = limits.max_shared_hz;
}

void add_step_rates(const verify::StepRates& sliced, const verify::StepRates* emitted,
                    report::StepRates& rates) {
  rates.motors.clear();
  for (std::size_t i = 0; i < sliced.motors.size(); ++i) {
    if (sliced.steps_per_mm[i] > 0.0) {
      rates.motors.push_back(
          row(sliced.motors[i], emitted != nullptr ? &emitted->motors[i] : nullptr));
      rates.motors.back().motor = sliced.names[i];
      rates.motors.back().steps_per_mm = sliced.steps_per_mm[i];
    }
  }
  rates.total = row(sliced.total, emitted != nullptr ? &emitted->total : nullptr);
}

void warn_of_sliced_steps(const std::vector<verify::StepBreach>& breaches, const std::string& input,
                          std::vector<std::string>& warnings) {
  for (const verify::StepBreach& breach : breaches) {
    warnings.push_back(to_string(Diagnostic{
        {input, breach.line},
        fmt::format("as sliced, {} (printer.max_step_rate_hz, max_total_step_rate_hz, driver, mcu)",
                    breach.message)}));
  }
}

}  // namespace unflex::flow
