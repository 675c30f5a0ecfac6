#include "worker_pool.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "wire.hpp"

namespace unflex::flow {
namespace {

// The life of a worker: read a window, solve it, answer, until the parent hangs up.
bool work(int channel, const WorkerPool::EngineFactory& factory) {
  const auto engine = factory();
  std::string message;
  while (platform::receive_message(channel, message)) {
    if (!platform::send_message(channel, answer(*engine, message))) {
      break;
    }
  }
  return true;
}

}  // namespace

std::string answer(const compensate::Engine& engine, std::string_view window) {
  try {
    return pack(engine.solve(unpack_window(window)));
  } catch (const std::exception& exception) {
    return pack(Result<compensate::AxisSolution>(fail(ErrorKind::internal, exception.what())));
  }
}

WorkerPool::WorkerPool(EngineFactory factory) : factory_(std::move(factory)) {}

Result<WorkerPool> WorkerPool::start(unsigned workers, const EngineFactory& factory) {
  WorkerPool pool(factory);
  // The vector gets its size before any fork: a worker closes the sockets of all earlier workers.
  pool.workers_.resize(workers);
  for (Worker& worker : pool.workers_) {
    if (Status status = pool.spawn(worker); !status) {
      return tl::unexpected(status.error());
    }
  }
  return pool;
}

WorkerPool::~WorkerPool() {
  for (Worker& worker : workers_) {
    end(worker);
  }
}

// Hangs up, which ends an idle worker; a busy one is killed.
void WorkerPool::end(Worker& worker) {
  worker.child.channel = {};
  if (worker.child.number > 0) {
    if (worker.task) {
      platform::kill_child(worker.child);
    } else {
      static_cast<void>(platform::wait_for_end(worker.child));
    }
  }
  worker.child = {};
}

Status WorkerPool::spawn(Worker& worker) {
  std::vector<int> others;
  for (const Worker& other : workers_) {
    if (other.child.channel.valid()) {
      others.push_back(other.child.channel.get());
    }
  }
  tl::expected<platform::Child, std::string> child =
      platform::fork_child([this](int channel) { return work(channel, factory_); },
                           platform::OnInterrupt::leave_to_parent, others);
  if (!child) {
    return fail(ErrorKind::internal, fmt::format("no solver process: {}", child.error()));
  }
  worker.child = std::move(*child);
  worker.task.reset();
  return {};
}

void WorkerPool::submit(std::size_t ticket, const compensate::AxisWindow& window) {
  queue_.push_back({ticket, pack(window)});
  feed();
}

// Gives every idle worker a window.
void WorkerPool::feed() {
  for (Worker& worker : workers_) {
    // A worker may die of its window, and its successor of the same window again.
    while (!queue_.empty() && !worker.task && worker.child.channel.valid()) {
      worker.task = std::move(queue_.front());
      queue_.pop_front();
      ++busy_;
      if (!platform::send_message(worker.child.channel.get(), worker.task->message)) {
        replace(worker);
      }
    }
  }
}

// Replaces a worker that died. Its window is tried once more.
void WorkerPool::replace(Worker& worker) {
  end(worker);
  Task task = std::move(*std::exchange(worker.task, std::nullopt));
  --busy_;
  if (task.tried) {
    failed_.push_back(task.ticket);
  } else {
    task.tried = true;
    queue_.push_front(std::move(task));
  }
  // Without a successor the remaining workers carry on; with none left the queue fails in take().
  static_cast<void>(spawn(worker));
}

std::optional<WorkerPool::Done> WorkerPool::take(int timeout_ms) {
  feed();
  if (!failed_.empty()) {
    Done done{failed_.front(), fail(ErrorKind::internal, "two solver processes died of it")};
    failed_.pop_front();
    return done;
  }
  std::vector<int> channels;
  std::vector<Worker*> owners;
  for (Worker& worker : workers_) {
    if (worker.task) {
      channels.push_back(worker.child.channel.get());
      owners.push_back(&worker);
    }
  }
  if (channels.empty()) {
    if (queue_.empty()) {
      return std::nullopt;
    }
    Done done{queue_.front().ticket, fail(ErrorKind::internal, "no solver process is left")};
    queue_.pop_front();
    return done;
  }
  const std::vector<std::size_t> ready =
      platform::ready_channels(channels, std::chrono::milliseconds(timeout_ms));
  if (ready.empty()) {
    return std::nullopt;
  }
  Worker& worker = *owners[ready.front()];
  std::string message;
  if (!platform::receive_message(worker.child.channel.get(), message)) {
    replace(worker);
    return take(timeout_ms);
  }
  Done done{worker.task->ticket, unpack_solution(message)};
  worker.task.reset();
  --busy_;
  feed();
  return done;
}

}  // namespace unflex::flow
