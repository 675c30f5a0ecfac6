// A print compensated for its report alone: what is written stays in memory and is dropped.
#pragma once

#include <cstddef>
#include <string_view>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"

namespace unflex::study {

// Progress of one part of a study. All parts count as equally long.
class PartProgress final : public Progress {
 public:
  PartProgress(Progress& all, std::size_t part, std::size_t parts)
      : all_(&all), part_(part), parts_(parts) {}
  void update(std::string_view phase, double fraction) override;
  [[nodiscard]] bool cancelled() const override { return all_->cancelled(); }

 private:
  Progress* all_;
  std::size_t part_;
  std::size_t parts_;
};

// The report of job.input compensated and verified; job.output has no part in it. An error of kind
// internal if the output breaks a rule; `at` says in it what was tried: "5000 mm/s²".
[[nodiscard]] Result<report::Report> compensate_in_memory(flow::Job job, std::string_view at,
                                                          Progress& progress);

}  // namespace unflex::study
