#include "process_solver.hpp"

#include <utility>
#include <vector>

namespace unflex::flow {

void ProcessSolver::submit(const std::shared_ptr<run::RunJob>& job, std::size_t first,
                           std::size_t count) {
  std::vector<compensate::RunWindow> windows = run::windows_of(*job, first, count);
  for (std::size_t i = 0; i < count; ++i) {
    const compensate::WindowSpan& span = job->windows.spans[first + i];
    compensate::prepare(*divider_, span, windows[i]);
    for (std::size_t axis = 0; axis < XY::kCount; ++axis) {
      tickets_.push_back({job, first + i, axis});
      const compensate::AxisWindow& window = windows[i][axis];
      if (span.cruise) {
        // A cruise is never a run's last window. So take() gets the run's last solution.
        job->windows.results[first + i][axis] = run::axis_result(compensate::along(window));
        run::note_solved(*job, 1);
      } else {
        processes_->submit(first_ticket_ + tickets_.size() - 1, window);
      }
    }
  }
}

std::shared_ptr<run::RunJob> ProcessSolver::take(int patience_ms) {
  std::optional<WorkerPool::Done> done = processes_->take(patience_ms);
  if (!done) {
    return nullptr;
  }
  const Ticket& ticket = tickets_[done->ticket - first_ticket_];
  ticket.job->windows.results[ticket.window][ticket.axis] =
      run::axis_result(std::move(done->solution));
  return run::note_solved(*ticket.job, 1) ? ticket.job : nullptr;
}

void ProcessSolver::forget(const run::RunJob& job) {
  const std::size_t tickets = 2 * job.windows.spans.size();
  tickets_.erase(tickets_.begin(), tickets_.begin() + static_cast<std::ptrdiff_t>(tickets));
  first_ticket_ += tickets;
}

void ProcessSolver::submit(const GapCheck& probes) {
  for (std::size_t i = 0; i < probes.probes().size(); ++i) {
    // Probes of runs that failed have no solution.
    if (!probes.probes()[i].solution.base.position_mm.empty()) {
      processes_->submit(i, probes.probes()[i].problem);
    }
  }
}

void ProcessSolver::take(const GapCheck& probes, int patience_ms, report::SolverCheck& check) {
  if (const std::optional<WorkerPool::Done> done = processes_->take(patience_ms);
      done && done->solution) {
    GapCheck::compare(probes.probes()[done->ticket], *done->solution, check);
  }
}

}  // namespace unflex::flow
