#include "unflex/pipeline/study_accels.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <string>
#include <utility>

#include "in_memory.hpp"
#include "memory_file.hpp"
#include "unflex/core/errno_text.hpp"

namespace unflex::pipeline {
namespace {

Status scale_accels(const Job& job, double ratio, const std::string& to) {
  std::ifstream input(job.input, std::ios::binary);
  std::ofstream output(to, std::ios::binary);
  std::string line;
  while (std::getline(input, line)) {
    output << study::with_scaled_accels(line, ratio) << (input.eof() ? "" : "\n");
  }
  output.flush();
  return input.eof() && output ? Status{}
                               : fail(ErrorKind::input, {job.input_name, 0}, "cannot be copied");
}

}  // namespace

Result<study::AccelsOutcome> study_accels(const Job& job, const std::vector<double>& accels_mm_s2,
                                          bool scale, Progress& progress) {
  study::AccelsOutcome outcome;
  outcome.input = job.input_name;
  outcome.scaled = scale;
  for (const double accel_mm_s2 : accels_mm_s2) {
    const MemoryFile input;
    if (!input.is_open()) {
      return fail(ErrorKind::internal,
                  fmt::format("no memory for the print: {}", errno_text(errno)));
    }
    Job at = job;
    at.settings.limits.max_accel_mm_s2 = accel_mm_s2;
    if (scale) {
      const double ratio = accel_mm_s2 / job.settings.limits.max_accel_mm_s2;
      if (Status scaled = scale_accels(job, ratio, input.name()); !scaled) {
        return tl::unexpected(scaled.error());
      }
      at.input = input.name();
    }
    PartProgress part(progress, outcome.accels.size(), accels_mm_s2.size());
    const Result<report::Report> report =
        compensate_in_memory(std::move(at), fmt::format("{:g} mm/s²", accel_mm_s2), part);
    if (!report) {
      return tl::unexpected(report.error());
    }
    outcome.accels.push_back({accel_mm_s2, report->reference_time_s, report->emitted_time_s,
                              report->uncompensated.extruding, report->compensated.extruding});
    for (const std::string& warning : report->warnings) {
      if (std::ranges::find(outcome.warnings, warning) == outcome.warnings.end()) {
        outcome.warnings.push_back(warning);
      }
    }
  }
  return outcome;
}

}  // namespace unflex::pipeline
