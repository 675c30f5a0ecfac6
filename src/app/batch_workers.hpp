// Works on prints side by side. Each print has a process of its own where the system can fork,
// otherwise a thread. Ipopt forks workers before its process has any thread, so two prints that it
// solves cannot share a process. A print whose process crashes, or is killed for want of memory,
// leaves the others alone.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "batch_result.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

class BatchWorkers {
 public:
  using Work = std::function<BatchAnswer()>;

  struct Done {
    std::size_t ticket = 0;
    bool answered = false;  // false: the error says how the process ended, without a place
    BatchAnswer answer;
    double wall_s = 0.0;
  };

  // workers: how many compute at once, over all prints.
  explicit BatchWorkers(unsigned workers);
  BatchWorkers(const BatchWorkers&) = delete;
  BatchWorkers& operator=(const BatchWorkers&) = delete;
  // Ends the prints under way. Asks them first, so that they remove their temporary files.
  ~BatchWorkers();

  // The number of workers for the next of `waiting` prints; 0 while no worker is free. All waiting
  // prints share the free workers.
  [[nodiscard]] unsigned workers_for_next(std::size_t waiting) const;

  // Begins the work. Its answer comes back with the ticket.
  [[nodiscard]] Status start(std::size_t ticket, unsigned workers, const Work& work);

  [[nodiscard]] bool any() const { return !running_.empty(); }

  // The prints that have ended. Waits a moment for one, or until a signal comes.
  [[nodiscard]] std::vector<Done> take();

 private:
  struct Running;
  struct Shared;

  [[nodiscard]] Done finish(Running& print);

  unsigned free_workers_;
  std::shared_ptr<Shared> shared_;
  std::vector<std::unique_ptr<Running>> running_;
};

}  // namespace unflex::app
