// The keys are documented in docs/report.md; a test holds the two together.

#include "step.hpp"
#include "unflex/report/json_parts.hpp"
#include "unflex/study/study.hpp"

namespace unflex::study {
namespace {

using report::Json;

Json straying_json(const Straying& straying, double frequency_error) {
  return {{"frequency_error", frequency_error},        {"contour_max_mm", straying.max_mm},
          {"contour_rms_mm", straying.rms_mm()},       {"after_max_mm", straying.after_max_mm},
          {"corners", straying.corners.count},         {"corner_max_mm", straying.corners.max_mm},
          {"corner_rms_mm", straying.corners.rms_mm()}};
}

Json method_json(const MethodResult& method) {
  Json json;
  json["method"] = name(method.method);
  json["used"] = method.used;
  json["remark"] = method.remark;
  if (!method.used) {
    return json;
  }
  json["deviation"] = Json::array();
  for (std::size_t i = 0; i < kFrequencyErrors.size(); ++i) {
    json["deviation"].push_back(straying_json(method.straying[i], kFrequencyErrors[i]));
  }
  json["base"] = {{"max_velocity_mm_s", method.base_peak.velocity_mm_s},
                  {"max_accel_mm_s2", method.base_peak.accel_mm_s2},
                  {"end_gap_mm", method.end_gap_mm}};
  json["longer_s"] = method.longer_s;
  const bool solves = method.size.unknowns > 0;
  json["unknowns"] = solves ? Json(method.size.unknowns) : Json(nullptr);
  json["equations"] = solves ? Json(method.size.equations) : Json(nullptr);
  json["iterations"] = method.iterations;
  json["failed_runs"] = method.failed_runs;
  return json;
}

Json case_json(const CaseResult& result) {
  Json methods = Json::array();
  for (const MethodResult& method : result.methods) {
    methods.push_back(method_json(method));
  }
  return {{"case", result.name},
          {"description", result.description},
          {"plan_s", result.plan_s},
          {"runs", result.runs},
          {"methods", methods}};
}

Json chain_json(const ChainResult& chain) {
  Json steps = Json::array();
  for (const ChainStep& step : chain.steps) {
    steps.push_back({{"period_ms", step.period_s * 1e3},
                     {"nodes", step.nodes},
                     {"contour_max_mm", step.contour_max_mm},
                     {"cold_iterations", step.cold_iterations},
                     {"warm_iterations", step.warm_iterations},
                     {"difference_mm", step.difference_mm}});
  }
  return {{"case", chain.case_name}, {"engine", chain.engine}, {"steps", steps}};
}

Json steps_json() {
  Json steps = Json::array();
  for (const StepRow& row : step_table()) {
    steps.push_back({{"zeta", row.zeta},
                     {"shaper", row.shaper},
                     {"overshoot", row.overshoot},
                     {"settled_s", row.settled_s ? Json(*row.settled_s) : Json(nullptr)},
                     {"left", row.left},
                     {"left_off", row.left_off}});
  }
  return steps;
}

// All that differs from one run of the program to the next.
Json performance_json(const Outcome& outcome) {
  Json cases = Json::array();
  for (const CaseResult& result : outcome.cases) {
    Json base_ms = Json::array();
    for (const MethodResult& method : result.methods) {
      base_ms.push_back(method.used ? Json(method.base_s * 1e3) : Json(nullptr));
    }
    cases.push_back({{"case", result.name}, {"base_ms", base_ms}});
  }
  Json chains = Json::array();
  for (const ChainResult& chain : outcome.chains) {
    Json cold = Json::array();
    Json warm = Json::array();
    for (const ChainStep& step : chain.steps) {
      cold.push_back(step.cold_s * 1e3);
      warm.push_back(step.warm_s * 1e3);
    }
    chains.push_back({{"cold_ms", cold}, {"warm_ms", warm}});
  }
  return {{"wall_s", outcome.wall_s}, {"cases", cases}, {"coarse_to_fine", chains}};
}

}  // namespace

std::string to_json(const Outcome& outcome) {
  Json json;
  json["schema_version"] = report::kSchemaVersion;
  json["command"] = "study";
  json["version"] = outcome.version;
  json["input"] = outcome.input.empty() ? Json(nullptr) : Json(outcome.input);
  json["printer"] = report::settings_json(outcome.printer);
  json["solver"] = {{"engine", outcome.engine}};
  json["cases"] = Json::array();
  for (const CaseResult& result : outcome.cases) {
    json["cases"].push_back(case_json(result));
  }
  json["coarse_to_fine"] = Json::array();
  for (const ChainResult& chain : outcome.chains) {
    json["coarse_to_fine"].push_back(chain_json(chain));
  }
  json["steps"] = outcome.input.empty() ? steps_json() : Json::array();
  json["warnings"] = outcome.warnings;
  json["performance"] = performance_json(outcome);
  return report::dump(json);
}

}  // namespace unflex::study
