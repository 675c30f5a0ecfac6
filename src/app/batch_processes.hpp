// Works on prints side by side, each in a process of its own. Compensating forks workers before its
// process has any thread, so two prints cannot share a process. And a print whose process crashes,
// or is killed for want of memory, leaves the others alone.
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
    bool answered = false;  // if not, the error says how the process ended, without a place
    BatchAnswer answer;
    double wall_s = 0.0;
  };

  // workers: how many compute at once, over all prints.
  explicit BatchProcesses(unsigned workers) : free_workers_(workers) {}
  BatchProcesses(const BatchProcesses&) = delete;
  BatchProcesses& operator=(const BatchProcesses&) = delete;
  // Ends the prints under way. Asks them first, so that they remove their temporary files.
  ~BatchProcesses();

  // How many workers the next of `waiting` prints gets, 0 while none is free. All waiting prints
  // share the free workers.
  [[nodiscard]] unsigned workers_for_next(std::size_t waiting) const;

  // Forks a process, which calls the work. Its answer comes back with the ticket.
  [[nodiscard]] Status start(std::size_t ticket, unsigned workers, const Work& work);

  [[nodiscard]] bool any() const { return !running_.empty(); }

  // The prints that have ended. Waits a moment for one, or until a signal comes.
  [[nodiscard]] std::vector<Done> take();

 private:
  struct Process {
    pid_t pid = -1;
    std::size_t ticket = 0;
    unsigned workers = 0;
    FileDescriptor answer;  // a pipe
    std::string text;       // packed answer, as far as it has come
    std::chrono::steady_clock::time_point start;
  };

  [[nodiscard]] Done finish(Process& process);

  unsigned free_workers_;
  std::vector<Process> running_;
};

}  // namespace unflex::app
