#include "signals.hpp"

#include <sys/time.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>
#include <csignal>
#include <cstring>
#include <initializer_list>
#include <mutex>

namespace unflex::app {
namespace {

constexpr int kSignalExitBase = 128;
// The time in which the work under way can end by itself, µs.
constexpr suseconds_t kPatience_us = 400'000;

volatile std::sig_atomic_t received = 0;

struct Slot {
  volatile std::sig_atomic_t used = 0;
  pid_t owner = 0;
  std::array<char, PATH_MAX> file{};
};
std::array<Slot, 8> unfinished;
std::mutex unfinished_mutex;

using Words = std::array<char, 256>;
Words last_words{};
Words last_words_with_result{};
pid_t main_process = 0;
volatile std::sig_atomic_t expected = 0;
volatile std::sig_atomic_t in_place = 0;

// Calls nothing but what a signal handler may call.
extern "C" void give_up(int /*signal*/) {
  bool removed = false;
  for (const Slot& slot : unfinished) {
    if (slot.used != 0 && slot.owner == ::getpid()) {
      removed = ::unlink(slot.file.data()) == 0 || removed;
    }
  }
  // Between expect_a_result() and note_result() nobody knows whether the result is in place, unless
  // a temporary file could still be removed. Then nothing is said.
  if (main_process == ::getpid() && (in_place != 0 || removed || expected == 0)) {
    const Words& words = in_place != 0 ? last_words_with_result : last_words;
    static_cast<void>(::write(STDERR_FILENO, words.data(), std::strlen(words.data())));
  }
  ::_exit(kSignalExitBase + received);
}

extern "C" void remember(int signal) {
  if (received == 0) {
    received = signal;
    constexpr itimerval kOnce{{0, 0}, {0, kPatience_us}};
    ::setitimer(ITIMER_REAL, &kOnce, nullptr);
  }
}

void keep(const std::string& text, Words& words) {
  const std::size_t length = std::min(text.size(), words.size() - 2);
  std::ranges::copy(text.substr(0, length) + '\n', words.begin());
}

}  // namespace

void catch_signals(const std::string& words, const std::string& words_with_result) {
  keep(words, last_words);
  keep(words_with_result, last_words_with_result);
  main_process = ::getpid();
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
  ::signal(SIGALRM, give_up);
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);
}

int ending_signal() { return received; }

void say_last_words_yourself() {
  constexpr itimerval kNever{};
  ::setitimer(ITIMER_REAL, &kNever, nullptr);
}

void remove_if_cut_short(const std::string& file) {
  const std::lock_guard lock(unfinished_mutex);
  for (Slot& slot : unfinished) {
    if (slot.used == 0 && file.size() < slot.file.size()) {
      std::strcpy(slot.file.data(), file.c_str());
      slot.owner = ::getpid();
      slot.used = 1;
      return;
    }
  }
}

void keep_if_cut_short(const std::string& file) {
  const std::lock_guard lock(unfinished_mutex);
  for (Slot& slot : unfinished) {
    if (slot.used != 0 && file == slot.file.data()) {
      slot.used = 0;
    }
  }
}

void expect_a_result() { expected = 1; }

void note_result() { in_place = 1; }

bool has_result() { return in_place != 0; }

}  // namespace unflex::app
