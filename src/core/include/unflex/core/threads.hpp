// Threads, locks and conditions, and substitutes for them where the library is built without
// threads (UNFLEX_THREADS). A substitute thread does its work when somebody waits for its end.
// Substitute locks and conditions never wait.
#pragma once

#ifdef UNFLEX_NO_THREADS

#include <cassert>
#include <functional>
#include <utility>

namespace unflex {

inline constexpr bool kHasThreads = false;

class Mutex {};

class Lock {
 public:
  explicit Lock(Mutex& /*mutex*/) {}
  void lock() {}
  void unlock() {}
};

class Condition {
 public:
  void notify_one() {}
  void notify_all() {}
  // The condition must hold already, since no other thread can bring it about.
  template <class Ready>
  void wait(Lock& /*lock*/, const Ready& ready) {
    assert(ready());
    static_cast<void>(ready);
  }
  template <class Duration, class Ready>
  bool wait_for(Lock& /*lock*/, const Duration& /*most*/, const Ready& ready) {
    return ready();
  }
};

class Thread {
 public:
  explicit Thread(std::function<void()> work) : work_(std::move(work)) {}
  void join() {
    std::exchange(work_, [] {})();
  }

 private:
  std::function<void()> work_;
};

inline unsigned processors() { return 1; }

// There is nobody to wait for.
template <class Duration>
void sleep_for(const Duration& /*time*/) {}

}  // namespace unflex

#else

#include <condition_variable>
#include <mutex>
#include <thread>
#include <utility>

namespace unflex {

inline constexpr bool kHasThreads = true;

using Mutex = std::mutex;
using Lock = std::unique_lock<std::mutex>;
using Condition = std::condition_variable;

// Waits for its work to end when it is destroyed. Not std::jthread, which not every library has.
class Thread {
 public:
  template <class Work>
  explicit Thread(Work work) : thread_(std::move(work)) {}
  Thread(Thread&&) noexcept = default;
  Thread& operator=(Thread&&) = delete;
  ~Thread() {
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  void join() { thread_.join(); }

 private:
  std::thread thread_;
};

// How many threads the machine runs at once, or 0 if that is not known.
inline unsigned processors() { return std::thread::hardware_concurrency(); }

template <class Duration>
void sleep_for(const Duration& time) {
  std::this_thread::sleep_for(time);
}

}  // namespace unflex

#endif
