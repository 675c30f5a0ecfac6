#include "in_memory.hpp"

#include <fmt/core.h>

#include <algorithm>
namespace unflex::study {

void PartProgress::update(std::string_view /*phase*/, double fraction) {
  all_->update("studying", (static_cast<double>(part_) + std::max(0.0, fraction)) /
                               static_cast<double>(parts_));
}

Result<report::Report> compensate_in_memory(flow::Job job, std::string_view at,
                                            Progress& progress) {
  job.output = memory_store();
  job.output_name = job.input_name;
  Result<report::Report> report = flow::compensate(job, progress);
  if (report && report->violation_count > 0) {
    return fail(ErrorKind::internal,
                fmt::format("at {} the output breaks a rule, which is a fault of unflex: {}", at,
                            report->violations.front()));
  }
  return report;
}

}  // namespace unflex::study
