// A fixed sample of the windows is solved by a second engine as well, which shares no code with the
// first. If motors move both axes, it gets each axis with that axis' share of the motors' limits.
// The shares are always the first engine's, so it checks how each axis uses its share, not how the
// limits are divided.
#pragma once

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "unflex/report/report.hpp"
#include "unflex/run/run_job.hpp"

namespace unflex::flow {

class GapCheck {
 public:
  static constexpr std::size_t kProbes = 8;

  // Chooses among the job's windows, which come in the order of the file (Vitter's algorithm R, ACM
  // Trans. Math. Softw. 11 (1985) 37). The choice is always the same for the same file.
  void choose(run::RunJob& job);
  // Takes the job's probes once they are solved.
  void take(run::RunJob& job);

  // The chosen problems with the first engine's solutions. compare() adds to `check` the gap of the
  // second engine's solution of one problem.
  [[nodiscard]] const std::vector<run::Probe>& probes() const { return probes_; }
  static void compare(const run::Probe& probe, const compensate::AxisSolution& second,
                      report::SolverCheck& check);

 private:
  std::mt19937_64 random_{0x756e666c6578};  // "unflex"
  std::uint64_t seen_ = 0;
  std::vector<run::Probe> probes_;
};

}  // namespace unflex::flow
