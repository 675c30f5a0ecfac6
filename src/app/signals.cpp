#include "signals.hpp"

#include <csignal>
#include <initializer_list>

namespace unflex::app {
namespace {

volatile std::sig_atomic_t received = 0;

extern "C" void remember(int signal) {
  if (received == 0) {
    received = signal;
  }
}

}  // namespace

void catch_signals() {
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
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);
}

int ending_signal() { return received; }

}  // namespace unflex::app
