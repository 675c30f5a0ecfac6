#include "unflex/platform/children.hpp"

#include <fmt/core.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <exception>

#ifdef __linux__
#include <sys/prctl.h>
#endif

namespace unflex::platform {
namespace {

// A dead peer shall give an error, not a signal.
#ifdef MSG_NOSIGNAL
constexpr int kSendFlags = MSG_NOSIGNAL;
#else
constexpr int kSendFlags = 0;
#endif

bool transfer(int channel, char* data, std::size_t size, bool sending) {
  while (size > 0) {
    const ssize_t count =
        sending ? ::send(channel, data, size, kSendFlags) : ::recv(channel, data, size, 0);
    if (count < 0 && errno == EINTR) {
      continue;
    }
    if (count <= 0) {
      return false;
    }
    data += count;
    size -= static_cast<std::size_t>(count);
  }
  return true;
}

int wait_for(int number, int options, int& status) {
  int got = 0;
  do {
    got = ::waitpid(number, &status, options);
  } while (got < 0 && errno == EINTR);
  return got;
}

// Should the parent be killed, its children go with it at once.
void die_with(pid_t parent) {
#ifdef __linux__
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
  if (::getppid() != parent) {
    ::_exit(0);
  }
}

[[noreturn]] void work_and_exit(int channel, const ChildWork& work,
                                OnInterrupt on_interrupt) noexcept {
  if (on_interrupt == OnInterrupt::leave_to_parent) {
    // Ctrl-C reaches the whole group; the parent decides when its children end.
    std::signal(SIGINT, SIG_IGN);
    std::signal(SIGTERM, SIG_DFL);
  }
  try {
    ::_exit(work(channel) ? 0 : 1);
  } catch (const std::exception&) {
    // Not even the answer fits into memory. The parent sees a child without an answer.
    ::_exit(1);
  }
}

}  // namespace

tl::expected<Child, std::string> fork_child(const ChildWork& work, OnInterrupt on_interrupt,
                                            std::span<const int> others) {
  int ends[2] = {-1, -1};
#ifdef SOCK_CLOEXEC
  const int opened = ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends);
#else
  const int opened = ::socketpair(AF_UNIX, SOCK_STREAM, 0, ends);
#endif
  if (opened != 0) {
    return tl::unexpected(
        fmt::format("cannot open a socket to another process: {}", std::strerror(errno)));
  }
  Child child{-1, FileDescriptor(ends[0])};
  const FileDescriptor of_child(ends[1]);
  const pid_t parent = ::getpid();
  child.number = ::fork();
  if (child.number < 0) {
    return tl::unexpected(fmt::format("cannot fork: {}", std::strerror(errno)));
  }
  if (child.number == 0) {
    ::close(ends[0]);
    for (const int other : others) {
      ::close(other);
    }
    die_with(parent);
    work_and_exit(ends[1], work, on_interrupt);
  }
  return child;
}

std::vector<std::size_t> ready_channels(std::span<const int> channels,
                                        std::chrono::milliseconds most) {
  std::vector<pollfd> polled;
  for (const int channel : channels) {
    polled.push_back({channel, POLLIN, 0});
  }
  std::vector<std::size_t> ready;
  if (::poll(polled.data(), static_cast<nfds_t>(polled.size()), static_cast<int>(most.count())) >
      0) {
    for (std::size_t i = 0; i < polled.size(); ++i) {
      if (polled[i].revents != 0) {
        ready.push_back(i);
      }
    }
  }
  return ready;
}

bool send_message(int channel, std::string_view message) {
  std::uint64_t size = message.size();
  return transfer(channel, reinterpret_cast<char*>(&size), sizeof size, true) &&
         transfer(channel, const_cast<char*>(message.data()), message.size(), true);
}

bool receive_message(int channel, std::string& message) {
  std::uint64_t size = 0;
  if (!transfer(channel, reinterpret_cast<char*>(&size), sizeof size, false)) {
    return false;
  }
  message.resize(static_cast<std::size_t>(size));
  return transfer(channel, message.data(), message.size(), false);
}

std::string wait_for_end(const Child& child) {
  int status = 0;
  static_cast<void>(wait_for(child.number, 0, status));
  if (WIFSIGNALED(status)) {
    return fmt::format("the process died of signal {} ({})", WTERMSIG(status),
                       ::strsignal(WTERMSIG(status)));
  }
  return WEXITSTATUS(status) == 0 ? "" : "the process ended without an answer";
}

bool has_ended(const Child& child) {
  int status = 0;
  return wait_for(child.number, WNOHANG, status) != 0;
}

void ask_to_end(const Child& child) { ::kill(child.number, SIGTERM); }

void kill_child(const Child& child) {
  ::kill(child.number, SIGKILL);
  int status = 0;
  static_cast<void>(wait_for(child.number, 0, status));
}

}  // namespace unflex::platform
