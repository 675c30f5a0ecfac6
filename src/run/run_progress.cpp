#include "unflex/run/run_progress.hpp"

#include <algorithm>
#include <cmath>

#include "unflex/core/math.hpp"
#include "unflex/run/run_job.hpp"

namespace unflex::run {
namespace {

// The share of a run's work that is done once its timing is found, if it is free, and once its
// windows are solved. Then its lines are left.
constexpr double kTiming = 0.8;
constexpr double kWindows = 0.9;

// A search that goes on gets slower and slower on the bar, as nobody knows how many rounds it has.
double share_timed(const RunJob& job) {
  constexpr double kRounds = 8.0;
  if (job.has_come_to(Stage::timed)) {
    return 1.0;
  }
  const double nodes_of_round = 2.0 * static_cast<double>(std::max<std::size_t>(job.grid.count, 1));
  return 1.0 - math::exp(-static_cast<double>(job.search.nodes) / (kRounds * nodes_of_round));
}

}  // namespace

Result<compensate::AxisSolution> CountedEngine::solve(const compensate::AxisWindow& window) const {
  Result<compensate::AxisSolution> solution = engine_->solve(window);
  *nodes_ += window.nodes();
  return solution;
}

double share_done(const RunJob& job) {
  if (job.has_come_to(Stage::lined)) {
    return 1.0;
  }
  const bool searches = !job.search.bounds.empty();
  const double timing = searches ? kTiming * share_timed(job) : 0.0;
  if (!job.has_come_to(Stage::laid_out) || job.windows.spans.empty()) {
    return timing;
  }
  const double windows = 2.0 * static_cast<double>(job.windows.spans.size());
  const double solved = 1.0 - static_cast<double>(job.windows.unsolved) / windows;
  return timing + (kWindows - timing) * solved;
}

}  // namespace unflex::run
