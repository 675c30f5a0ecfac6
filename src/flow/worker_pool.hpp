// Processes that solve axis windows. MUMPS below Ipopt is not thread-safe, so each solver lives in
// a process of its own, forked before the program has any thread.
#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/compensate/axis_window.hpp"
#include "unflex/core/error.hpp"
#include "unflex/platform/children.hpp"

namespace unflex::flow {

// A worker's packed answer to a packed window: the solution, or an error with what the solver
// threw, such as std::bad_alloc.
[[nodiscard]] std::string answer(const compensate::Engine& engine, std::string_view window);

class WorkerPool {
 public:
  using EngineFactory = std::function<std::unique_ptr<compensate::Engine>()>;

  struct Done {
    std::size_t ticket = 0;
    Result<compensate::AxisSolution> solution;
  };

  // Forks `workers` processes, each with an engine of its own.
  [[nodiscard]] static Result<WorkerPool> start(unsigned workers, const EngineFactory& factory);

  WorkerPool(WorkerPool&& other) noexcept = default;
  WorkerPool& operator=(WorkerPool&&) = delete;
  // Ends the workers, at once if they are still busy.
  ~WorkerPool();

  // Queues a window; the ticket comes back with its solution.
  void submit(std::size_t ticket, const compensate::AxisWindow& window);

  // A solution that has arrived; waits up to timeout_ms for one. nullopt when none came or nothing
  // is under way. A worker that died is replaced and its window solved once more; a window that two
  // workers died of comes back as an error.
  [[nodiscard]] std::optional<Done> take(int timeout_ms);

  // Windows submitted and not yet taken.
  [[nodiscard]] std::size_t under_way() const { return queue_.size() + busy_ + failed_.size(); }

 private:
  struct Task {
    std::size_t ticket;
    std::string message;
    bool tried = false;  // a worker died of it
  };
  struct Worker {
    platform::Child child;
    std::optional<Task> task;  // the window it is solving
  };

  explicit WorkerPool(EngineFactory factory);
  Status spawn(Worker& worker);
  static void end(Worker& worker);
  void feed();
  void replace(Worker& worker);

  EngineFactory factory_;
  std::vector<Worker> workers_;
  std::deque<Task> queue_;
  std::deque<std::size_t> failed_;  // tickets of windows that two workers died of
  std::size_t busy_ = 0;
};

}  // namespace unflex::flow
