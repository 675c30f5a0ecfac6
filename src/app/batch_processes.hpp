// Prints side by side, each in a process of its own. Compensating forks workers, which must be
// before a process has any thread, so that two prints in one process would not do; and a print that
// takes its process down, or is shot for want of memory, leaves the others alone.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "batch_result.hpp"
#include "files.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

class BatchProcesses {
 public:
  using Work = std::function<BatchAnswer()>;

  struct Done {
    std::size_t ticket = 0;
    bool answered = false;  // otherwise the error says how the process ended, without a place
    BatchAnswer answer;
    double wall_s = 0.0;
  };

  // At most `workers` of all of them compute at once.
  explicit BatchProcesses(unsigned workers) : free_workers_(workers) {}
  BatchProcesses(const BatchProcesses&) = delete;
  BatchProcesses& operator=(const BatchProcesses&) = delete;
  // Ends what is under way: asks first, so that temporary files go.
  ~BatchProcesses();

  // How many workers the next of `waiting` prints gets, 0 while none is free: all of them share
  // what is free.
  [[nodiscard]] unsigned workers_for_next(std::size_t waiting) const;

  // Forks. The work is called in the new process, its answer comes back with the ticket.
  [[nodiscard]] Status start(std::size_t ticket, unsigned workers, const Work& work);

  [[nodiscard]] bool any() const { return !running_.empty(); }

  // Those that have ended; waits a moment for one, or until a signal comes.
  [[nodiscard]] std::vector<Done> take();

 private:
  struct Process {
    pid_t pid = -1;
    std::size_t ticket = 0;
    unsigned workers = 0;
    FileDescriptor answer;  // a pipe
    std::string text;       // of the answer, as far as it has come
    std::chrono::steady_clock::time_point start;
  };

  [[nodiscard]] Done finish(Process& process);

  unsigned free_workers_;
  std::vector<Process> running_;
};

}  // namespace unflex::app
