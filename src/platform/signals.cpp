#include "unflex/platform/signals.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>

#include "signal_calls.hpp"
#include "unflex/core/threads.hpp"
#include "unflex/platform/descriptors.hpp"
#include "unflex/platform/process.hpp"

namespace unflex::platform {
namespace {

constexpr int kSignalExitBase = 128;
constexpr std::size_t kLongestName = 4096;

// Without a lock, since a signal handler reads and writes them.
std::atomic<int> received = 0;
static_assert(std::atomic<int>::is_always_lock_free);

struct Slot {
  std::atomic<int> used = 0;
  long owner = 0;
  std::array<char, kLongestName> file{};
};
std::array<Slot, 8> unfinished;
Mutex unfinished_mutex;

using Words = std::array<char, 256>;
Words last_words{};
Words last_words_with_result{};
long main_process = 0;
std::atomic<int> expected = 0;
std::atomic<int> in_place = 0;

void keep(const std::string& text, Words& words) {
  const std::size_t length = std::min(text.size(), words.size() - 2);
  std::ranges::copy(text.substr(0, length) + '\n', words.begin());
}

}  // namespace

bool remember_signal(int signal) {
  if (received != 0) {
    return false;
  }
  received = signal;
  return true;
}

// Calls nothing but what a signal handler may call.
void give_up() {
  bool removed = false;
  for (const Slot& slot : unfinished) {
    if (slot.used != 0 && slot.owner == process_number()) {
      removed = remove_at_once(slot.file.data()) || removed;
    }
  }
  // Between expect_a_result() and note_result() nobody knows whether the result is in place, unless
  // a temporary file could still be removed. Then nothing is said.
  if (main_process == process_number() && (in_place != 0 || removed || expected == 0)) {
    const Words& words = in_place != 0 ? last_words_with_result : last_words;
    static_cast<void>(write_bytes(kStandardError, {words.data(), std::strlen(words.data())}));
  }
  end_at_once(kSignalExitBase + received);
}

void catch_signals(const std::string& words, const std::string& words_with_result) {
  keep(words, last_words);
  keep(words_with_result, last_words_with_result);
  main_process = process_number();
  start_catching();
}

int ending_signal() { return received; }

void say_last_words_yourself() { call_off_giving_up(); }

void remove_if_cut_short(const std::string& file) {
  const Lock lock(unfinished_mutex);
  for (Slot& slot : unfinished) {
    if (slot.used == 0 && file.size() < slot.file.size()) {
      std::strcpy(slot.file.data(), file.c_str());
      slot.owner = process_number();
      slot.used = 1;
      return;
    }
  }
}

void keep_if_cut_short(const std::string& file) {
  const Lock lock(unfinished_mutex);
  for (Slot& slot : unfinished) {
    if (slot.used != 0 && file == slot.file.data()) {
      slot.used = 0;
    }
  }
}

void expect_a_result() { expected = 1; }

void note_result() { in_place = 1; }

bool has_result() { return in_place != 0; }

}  // namespace unflex::platform
