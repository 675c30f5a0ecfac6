// Tries for a run whose lines break a rule, made one after the other, before its sliced lines must
// stand. Each try is a run by itself, and is worked out from its timing on.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "unflex/run/run_job.hpp"

namespace unflex::run {

enum class Remedy {
  scaled,     // a scaled timing instead of the one at hand
  as_sliced,  // the timing as sliced
  reserve,    // the timing at hand and a base that asks less of the motors
};

struct Try {
  Remedy remedy = Remedy::scaled;
  double accel_share = 1.0;  // of the acceleration that the motors may have
};

class Tries {
 public:
  // objection: why the run itself cannot be written. whole_steps: its lines end on whole steps.
  Tries(const RunJob& job, std::string objection, bool whole_steps);

  // The next one; nullopt if none is left.
  [[nodiscard]] std::optional<Try> next();
  [[nodiscard]] bool has_given() const { return count_ > 0; }
  // The last one that next() gave.
  [[nodiscard]] const Try& present() const { return tries_[count_ - 1]; }
  // Why the run itself cannot be written.
  [[nodiscard]] const std::string& objection() const { return objection_; }

 private:
  std::vector<Try> tries_;
  std::size_t count_ = 0;  // number of tries given so far
  std::string objection_;
};

// The run of `job` once more, for a try. It is read, not timed.
[[nodiscard]] std::shared_ptr<RunJob> once_more(const RunJob& job, const Try& next);

// Works out the run of a try as far as its lines. Throws nothing.
void work_out(RunJob& run, Remedy remedy) noexcept;

}  // namespace unflex::run
