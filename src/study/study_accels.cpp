#include "unflex/study/study_accels.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <istream>
#include <memory>
#include <string>
#include <utility>

#include "in_memory.hpp"

namespace unflex::study {
namespace {

Result<std::string> with_scaled_accels(const flow::Job& job, double ratio) {
  const std::unique_ptr<std::istream> input = job.input->read();
  std::string result;
  std::string line;
  while (std::getline(*input, line)) {
    result += study::with_scaled_accels(line, ratio);
    result += input->eof() ? "" : "\n";
  }
  if (!input->eof()) {
    return fail(ErrorKind::input, {job.input_name, 0}, "cannot be copied");
  }
  return result;
}

}  // namespace

Result<study::AccelsOutcome> study_accels(const flow::Job& job,
                                          const std::vector<double>& accels_mm_s2, bool scale,
                                          Progress& progress) {
  study::AccelsOutcome outcome;
  outcome.input = job.input_name;
  outcome.scaled = scale;
  for (const double accel_mm_s2 : accels_mm_s2) {
    flow::Job at = job;
    at.settings.limits.max_accel_mm_s2 = accel_mm_s2;
    if (scale) {
      const double ratio = accel_mm_s2 / job.settings.limits.max_accel_mm_s2;
      Result<std::string> scaled = with_scaled_accels(job, ratio);
      if (!scaled) {
        return tl::unexpected(scaled.error());
      }
      at.input = memory_store(std::move(*scaled));
    }
    PartProgress part(progress, outcome.accels.size(), accels_mm_s2.size());
    const Result<report::Report> report =
        compensate_in_memory(std::move(at), fmt::format("{:g} mm/s²", accel_mm_s2), part);
    if (!report) {
      return tl::unexpected(report.error());
    }
    outcome.accels.push_back(
        {accel_mm_s2, report->measured.uncompensated.time_s, report->measured.compensated.time_s,
         report->measured.uncompensated.extruding, report->measured.compensated.extruding});
    for (const std::string& warning : report->warnings) {
      if (std::ranges::find(outcome.warnings, warning) == outcome.warnings.end()) {
        outcome.warnings.push_back(warning);
      }
    }
  }
  return outcome;
}

}  // namespace unflex::study
