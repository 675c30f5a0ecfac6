// compensate() with any solver.
#pragma once

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/pipeline/pipeline.hpp"
#include "unflex/report/report.hpp"
#include "worker_pool.hpp"

namespace unflex::pipeline {

// Every worker makes its own engine, and so does the caller's process, once, for its name.
[[nodiscard]] Result<report::Report> compensate_with(const Job& job,
                                                     const WorkerPool::EngineFactory& engine,
                                                     Progress& progress);

}  // namespace unflex::pipeline
