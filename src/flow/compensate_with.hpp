// compensate() with any solvers.
#pragma once

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/report/report.hpp"
#include "worker_pool.hpp"

namespace unflex::flow {

// If `threaded` is set, it solves in threads, and `second`, if set, checks a sample of the windows
// in a process of its own. If `threaded` is not set, `second` solves everything, in as many
// processes as there are workers, each with its own engine.
struct Engines {
  WorkerPool::EngineFactory threaded;
  WorkerPool::EngineFactory second;
};

[[nodiscard]] Result<report::Report> compensate_with(const Job& job, const Engines& engines,
                                                     Progress& progress);

}  // namespace unflex::flow
