// The bench of real machines on a print.
#pragma once

#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/study/machines.hpp"

namespace unflex::study {

// A machine, and the printer with the axes as they are known.
struct KnownMachine {
  std::string name;
  machine::Settings settings;
  Axes<study::MachineAxis> axes;
};

// Tries all contenders on every run of `job.input`, planned as `compensate` plans it. Settings are
// each machine's own, the job's serve for the plan.
[[nodiscard]] Result<study::MachinesOutcome> study_machines(
    const flow::Job& job, const std::vector<KnownMachine>& machines, Progress& progress);

}  // namespace unflex::study
