#include "worker_pool.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <utility>

#include "wire.hpp"

namespace unflex::pipeline {
namespace {

// The life of a worker: read a window, solve it, answer, until the parent hangs up. Leaves by
// _exit, so that nothing the parent has open is flushed twice. Lets no exception out, since it
// would pass through the parent's code and clean up what is the parent's.
[[noreturn]] void work(int socket, const WorkerPool::EngineFactory& factory) noexcept {
  // Ctrl-C reaches the whole group; the parent decides when its workers end.
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_DFL);
  try {
    const auto engine = factory();
    std::string message;
    while (receive_message(socket, message)) {
      if (!send_message(socket, answer(*engine, message))) {
        break;
      }
    }
  } catch (const std::exception&) {
    // Not even the message fits into memory. The parent sees a worker that died.
    _exit(1);
  }
  _exit(0);
}

}  // namespace

std::string answer(const compensate::Engine& engine, std::string_view window) {
  try {
    return pack(engine.solve(unpack_window(window)));
  } catch (const std::exception& exception) {
    return pack(Result<compensate::AxisSolution>(fail(ErrorKind::internal, exception.what())));
  }
}

struct WorkerPool::Worker {
  pid_t pid = -1;
  int socket = -1;
  std::optional<Task> task;  // the window it is solving
};

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

WorkerPool::WorkerPool(WorkerPool&& other) noexcept
    : factory_(std::move(other.factory_)),
      workers_(std::exchange(other.workers_, {})),
      queue_(std::move(other.queue_)),
      failed_(std::move(other.failed_)),
      busy_(std::exchange(other.busy_, 0)) {}

WorkerPool::~WorkerPool() {
  for (Worker& worker : workers_) {
    if (worker.socket >= 0) {
      close(worker.socket);
    }
    if (worker.pid > 0) {
      if (worker.task) {
        kill(worker.pid, SIGKILL);
      }
      waitpid(worker.pid, nullptr, 0);
    }
  }
}

Status WorkerPool::spawn(Worker& worker) {
  int pair[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0) {
    return fail(ErrorKind::internal,
                fmt::format("cannot open a socket to a solver process: {}", std::strerror(errno)));
  }
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0) {
    const int reason = errno;
    close(pair[0]);
    close(pair[1]);
    return fail(ErrorKind::internal,
                fmt::format("cannot fork a solver process: {}", std::strerror(reason)));
  }
  if (pid == 0) {
    close(pair[0]);
    for (const Worker& other : workers_) {
      if (other.socket >= 0) {
        close(other.socket);
      }
    }
    // Should the parent be killed, the workers go with it.
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) {
      _exit(0);
    }
    work(pair[1], factory_);
  }
  close(pair[1]);
  worker = {pid, pair[0], std::nullopt};
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
    while (!queue_.empty() && !worker.task && worker.socket >= 0) {
      worker.task = std::move(queue_.front());
      queue_.pop_front();
      ++busy_;
      if (!send_message(worker.socket, worker.task->message)) {
        replace(worker);
      }
    }
  }
}

// Replaces a worker that died. Its window is tried once more.
void WorkerPool::replace(Worker& worker) {
  close(worker.socket);
  kill(worker.pid, SIGKILL);
  waitpid(worker.pid, nullptr, 0);
  Task task = std::move(*worker.task);
  worker = {};
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
  std::vector<pollfd> sockets;
  std::vector<Worker*> owners;
  for (Worker& worker : workers_) {
    if (worker.task) {
      sockets.push_back({worker.socket, POLLIN, 0});
      owners.push_back(&worker);
    }
  }
  if (sockets.empty()) {
    if (queue_.empty()) {
      return std::nullopt;
    }
    Done done{queue_.front().ticket, fail(ErrorKind::internal, "no solver process is left")};
    queue_.pop_front();
    return done;
  }
  if (poll(sockets.data(), sockets.size(), timeout_ms) <= 0) {
    return std::nullopt;
  }
  for (std::size_t i = 0; i < sockets.size(); ++i) {
    if (sockets[i].revents == 0) {
      continue;
    }
    Worker& worker = *owners[i];
    std::string message;
    if (!receive_message(worker.socket, message)) {
      replace(worker);
      return take(timeout_ms);
    }
    Done done{worker.task->ticket, unpack_solution(message)};
    worker.task.reset();
    --busy_;
    feed();
    return done;
  }
  return std::nullopt;
}

}  // namespace unflex::pipeline
