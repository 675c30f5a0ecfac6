// Verifies the output while it is being written.
#pragma once

#include <atomic>
#include <deque>
#include <exception>
#include <istream>
#include <optional>
#include <streambuf>
#include <string>

#include "cpu_slots.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/core/threads.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::flow {

// A text that one thread writes and another reads. The reader gives its slot back while it waits.
class TextQueue final : public std::streambuf {
 public:
  explicit TextQueue(CpuSlots& slots) : slots_(&slots) {}

  void push(std::string text);
  void end();
  // Nobody reads any more: drops what is there and what is still to come.
  void drop();
  // Whether more than a few MB are still to be read.
  [[nodiscard]] bool is_long();
  // Whether the reader waits for more.
  [[nodiscard]] bool is_starved();

 protected:
  int_type underflow() override;

 private:
  CpuSlots* slots_;
  Mutex mutex_;
  Condition changed_;
  std::deque<std::string> texts_;
  std::size_t bytes_ = 0;
  bool reader_waits_ = false;
  bool ended_ = false;
  bool dropped_ = false;
  std::string current_;  // text that is being read
};

class VerifyThread {
 public:
  // The objects that the observation refers to must outlive this object.
  VerifyThread(const verify::Rules& rules, const verify::Observation& observation,
               std::string input_name, std::string output_name, CpuSlots& slots);
  // Stops the verification if it is still under way.
  ~VerifyThread();
  VerifyThread(const VerifyThread&) = delete;
  VerifyThread& operator=(const VerifyThread&) = delete;

  // Appends to both texts. Does not wait.
  void push(std::string input, std::string output);
  // Whether the verification is so far behind that the caller should wait for it. Never true while
  // it waits for text itself: a run of many MB is read to its end only when what follows is there.
  [[nodiscard]] bool is_behind();
  // Tells that both texts have ended.
  void end();
  // After end(): waits for the result, or finds it where the library has no threads. Throws what
  // the thread could not handle, such as memory that ran out.
  [[nodiscard]] Result<verify::VerifyReport> result();

 private:
  class Stopped final : public Progress {
   public:
    void update(std::string_view /*stage*/, double /*fraction*/) override {}
    [[nodiscard]] bool cancelled() const override { return now; }

    std::atomic<bool> now = false;
  };

  TextQueue input_;
  TextQueue output_;
  Stopped stopped_;
  Result<verify::VerifyReport> result_;
  std::exception_ptr failure_;
  Thread thread_;
};

}  // namespace unflex::flow
