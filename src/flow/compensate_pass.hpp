// One pass over a print: reads pieces, has runs worked on, writes them in order, verifies.
#pragma once

#include <functional>
#include <istream>
#include <ostream>
#include <vector>

#include "compensate_with.hpp"
#include "cpu_slots.hpp"
#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/report/report.hpp"
#include "unflex/verify/verify.hpp"
#include "worker_pool.hpp"

namespace unflex::flow {

// The input and the output of a pass. All objects must outlive it.
struct PassStreams {
  std::istream& input;
  std::ostream& output;
  WorkerPool& processes;
  CpuSlots& slots;
  std::function<void()> stop_input;  // see PieceThread
  bool last = false;                 // no other pass follows
};

struct PassOutcome {
  Status status;
  // Runs that break rules in the output, and a run in which a part could not be written.
  std::vector<verify::BlamedRun> blamed = {};
  std::vector<verify::TimeNote> time_notes = {};
};

// kept: runs to be left as sliced.
[[nodiscard]] PassOutcome compensate_pass(const Job& job, const Engines& engines,
                                          const std::vector<verify::BlamedRun>& kept,
                                          const PassStreams& streams, Progress& progress,
                                          report::Report& report);

}  // namespace unflex::flow
