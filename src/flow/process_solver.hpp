// Has windows solved in processes, each with an engine of its own.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <optional>

#include "gap_check.hpp"
#include "unflex/run/run_job.hpp"
#include "worker_pool.hpp"

namespace unflex::flow {

class ProcessSolver {
 public:
  explicit ProcessSolver(WorkerPool& processes) : processes_(&processes) {}

  [[nodiscard]] std::size_t under_way() const { return processes_->under_way(); }
  // Submits these windows.
  void submit(const std::shared_ptr<run::RunJob>& job, std::size_t first, std::size_t count);
  // Waits for a window, at most for patience_ms. Returns the window's run if the run is solved now.
  [[nodiscard]] std::shared_ptr<run::RunJob> take(int patience_ms);
  // Forgets a job whose windows were all submitted and solved. It must be the oldest of the
  // submitted ones.
  void forget(const run::RunJob& job);

  // Submits the probes. No windows are under way.
  void submit(const GapCheck& probes);
  // Waits for a probe, at most for patience_ms, and compares it.
  void take(const GapCheck& probes, int patience_ms, report::SolverCheck& check);

 private:
  // The solution that a number given to the processes stands for.
  struct Ticket {
    std::shared_ptr<run::RunJob> job;
    std::size_t window;
    std::size_t axis;
  };

  WorkerPool* processes_;
  std::deque<Ticket> tickets_;
  std::size_t first_ticket_ = 0;  // number of the first ticket in tickets_
  std::unique_ptr<compensate::Engine> divider_ = compensate::make_banded_engine();
};

}  // namespace unflex::flow
