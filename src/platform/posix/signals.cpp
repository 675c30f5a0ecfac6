#include <sys/time.h>
#include <unistd.h>

#include <csignal>

#include "../signal_calls.hpp"

namespace unflex::platform {
namespace {

// The time in which the work under way can end by itself, µs.
constexpr suseconds_t kPatience_us = 400'000;

extern "C" void remember(int signal) {
  if (remember_signal(signal)) {
    constexpr itimerval kOnce{{0, 0}, {0, kPatience_us}};
    ::setitimer(ITIMER_REAL, &kOnce, nullptr);
  }
}

extern "C" void end_now(int /*signal*/) { give_up(); }

}  // namespace

void start_catching() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction action {};
    ::sigaction(signal, nullptr, &action);
    if (action.sa_handler != SIG_IGN) {
      // Without SA_RESTART, so that waiting for stdin ends.
      action.sa_handler = remember;
      action.sa_flags = 0;
      ::sigaction(signal, &action, nullptr);
    }
  }
  ::signal(SIGALRM, end_now);
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);
}

void call_off_giving_up() {
  constexpr itimerval kNever{};
  ::setitimer(ITIMER_REAL, &kNever, nullptr);
}

bool remove_at_once(const char* name) { return ::unlink(name) == 0; }

void end_at_once(int exit_code) { ::_exit(exit_code); }

}  // namespace unflex::platform
