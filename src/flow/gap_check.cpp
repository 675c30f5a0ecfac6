#include "gap_check.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace unflex::flow {
namespace {

// If nothing moves in a window, its objective is made of rounding errors. So the gap is taken
// relative to at least the objective of an error of 1 nm throughout.
constexpr double kNothing_mm = 1e-6;

}  // namespace

void GapCheck::choose(run::RunJob& job) {
  for (std::size_t window = 0; window < job.windows.spans.size(); ++window) {
    for (std::size_t axis = 0; axis < 2 && !job.windows.spans[window].cruise; ++axis) {
      const std::uint64_t number = seen_++;
      // Not std::uniform_int_distribution: its numbers differ between libraries.
      const std::uint64_t slot = number < kProbes ? number : random_() % (number + 1);
      if (slot < kProbes) {
        job.windows.probes.push_back({static_cast<std::size_t>(slot), window, axis, {}, {}});
      }
    }
  }
}

void GapCheck::take(run::RunJob& job) {
  for (run::Probe& probe : job.windows.probes) {
    if (probes_.size() <= probe.slot) {
      probes_.resize(probe.slot + 1);
    }
    probes_[probe.slot] = std::move(probe);
  }
}

void GapCheck::compare(const run::Probe& probe, const compensate::AxisSolution& second,
                       report::SolverCheck& check) {
  const double nothing = kNothing_mm * kNothing_mm * static_cast<double>(probe.problem.nodes()) *
                         probe.problem.period_s;
  ++check.windows;
  check.largest_gap =
      std::max(check.largest_gap, std::abs(probe.solution.objective - second.objective) /
                                      std::max(second.objective, nothing));
  for (std::size_t k = 0; k < second.base.position_mm.size(); ++k) {
    check.largest_difference_mm =
        std::max(check.largest_difference_mm,
                 std::abs(probe.solution.base.position_mm[k] - second.base.position_mm[k]));
  }
}

}  // namespace unflex::flow
