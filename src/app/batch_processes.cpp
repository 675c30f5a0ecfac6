#include "batch_processes.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <thread>
#include <utility>

#include "signals.hpp"

namespace unflex::app {
namespace {

constexpr int kPatienceMs = 100;
// The time that prints get to end by themselves before they are killed.
constexpr std::chrono::milliseconds kGrace{200};
constexpr std::chrono::milliseconds kBetweenLooks{5};

int wait_for(pid_t pid, int options, int& status) {
  int got = 0;
  do {
    got = ::waitpid(pid, &status, options);
  } while (got < 0 && errno == EINTR);
  return got;
}

// Leaves by _exit, so that nothing the parent has open is flushed or removed twice. Lets no
// exception out, since it would pass through the parent's code and end the other prints.
[[noreturn]] void answer_and_exit(pid_t parent, int pipe,
                                  const BatchProcesses::Work& work) noexcept {
  // Should the parent be killed, its prints go with it at once: they hold its claim on the folder.
  // Their temporary files are removed when the batch is started again.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) {
    ::_exit(0);
  }
  try {
    static_cast<void>(write_all(pipe, pack(work())));
  } catch (const std::exception&) {
    // Not even the answer fits into memory. The parent sees a print without an answer.
    ::_exit(1);
  }
  ::_exit(0);
}

BatchAnswer died(int status) {
  BatchAnswer answer;
  answer.error = WIFSIGNALED(status) ? fmt::format("the process died of signal {} ({})",
                                                   WTERMSIG(status), ::strsignal(WTERMSIG(status)))
                                     : "the process ended without an answer";
  return answer;
}

}  // namespace

BatchProcesses::~BatchProcesses() {
  for (const Process& process : running_) {
    ::kill(process.pid, SIGTERM);
  }
  const auto end = std::chrono::steady_clock::now() + kGrace;
  int status = 0;
  while (!running_.empty() && std::chrono::steady_clock::now() < end) {
    std::erase_if(running_, [&](const Process& process) {
      return wait_for(process.pid, WNOHANG, status) != 0;
    });
    std::this_thread::sleep_for(kBetweenLooks);
  }
  for (const Process& process : running_) {
    ::kill(process.pid, SIGKILL);
    static_cast<void>(wait_for(process.pid, 0, status));
  }
}

unsigned BatchProcesses::workers_for_next(std::size_t waiting) const {
  if (free_workers_ == 0 || waiting == 0) {
    return 0;
  }
  return std::max(
      1U, free_workers_ / static_cast<unsigned>(std::min<std::size_t>(waiting, free_workers_)));
}

Status BatchProcesses::start(std::size_t ticket, unsigned workers, const Work& work) {
  int ends[2] = {-1, -1};
  if (::pipe2(ends, O_CLOEXEC) != 0) {
    return fail(ErrorKind::internal, fmt::format("cannot open a pipe: {}", errno_text(errno)));
  }
  FileDescriptor read_end(ends[0]);
  const FileDescriptor write_end(ends[1]);
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid < 0) {
    return fail(ErrorKind::internal, fmt::format("cannot fork: {}", errno_text(errno)));
  }
  if (pid == 0) {
    answer_and_exit(parent, write_end.get(), work);
  }
  free_workers_ -= workers;
  running_.push_back(
      {pid, ticket, workers, std::move(read_end), {}, std::chrono::steady_clock::now()});
  return {};
}

std::vector<BatchProcesses::Done> BatchProcesses::take() {
  std::vector<pollfd> pipes;
  for (const Process& process : running_) {
    pipes.push_back({process.answer.get(), POLLIN, 0});
  }
  std::vector<Done> all;
  if (::poll(pipes.data(), pipes.size(), kPatienceMs) <= 0) {
    return all;
  }
  for (std::size_t i = pipes.size(); i-- > 0;) {
    if (pipes[i].revents == 0) {
      continue;
    }
    const tl::expected<std::string, int> block = read_some(pipes[i].fd);
    if (!block && ending_signal() != 0) {
      break;
    }
    if (block && !block->empty()) {
      running_[i].text += *block;
      continue;
    }
    all.push_back(finish(running_[i]));
    running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return all;
}

BatchProcesses::Done BatchProcesses::finish(Process& process) {
  int status = 0;
  static_cast<void>(wait_for(process.pid, 0, status));
  free_workers_ += process.workers;
  const bool answered = WIFEXITED(status) && WEXITSTATUS(status) == 0 && !process.text.empty();
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - process.start;
  return {process.ticket, answered, answered ? unpack(process.text) : died(status), wall.count()};
}

}  // namespace unflex::app
