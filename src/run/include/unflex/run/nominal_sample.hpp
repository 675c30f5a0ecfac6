// Chooses the runs for which a second base is found, for the nominal axes alone: an eighth of the
// print, or its beginning. The second base takes as long as the first, and only shows the cost of
// suiting a band.
#pragma once

#include <algorithm>

#include "unflex/run/run_job.hpp"

namespace unflex::run {

class NominalSample {
 public:
  // The next run of the file, which is laid out.
  void choose(RunJob& job) {
    constexpr double kShare = 8.0;
    constexpr double kAlways_s = 120.0;
    const double duration_s = planner::duration_s(job.reference());
    job.robustness.is_measured =
        job.setup.is_robust() && chosen_s_ + duration_s <= std::max(offered_s_ / kShare, kAlways_s);
    offered_s_ += duration_s;
    chosen_s_ += job.robustness.is_measured ? duration_s : 0.0;
  }

 private:
  double offered_s_ = 0.0;  // how long all runs so far take
  double chosen_s_ = 0.0;   // how long the chosen runs take
};

}  // namespace unflex::run
