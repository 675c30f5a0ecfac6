#include "verify_thread.hpp"

#include <utility>

#include "unflex/core/threads.hpp"

namespace unflex::flow {
namespace {

constexpr std::size_t kLong_bytes = 4U << 20U;

}  // namespace

void TextQueue::push(std::string text) {
  {
    const Lock lock(mutex_);
    if (dropped_) {
      return;
    }
    bytes_ += text.size();
    reader_waits_ = reader_waits_ && text.empty();
    texts_.push_back(std::move(text));
  }
  changed_.notify_one();
}

void TextQueue::end() {
  {
    const Lock lock(mutex_);
    ended_ = true;
  }
  changed_.notify_one();
}

void TextQueue::drop() {
  const Lock lock(mutex_);
  dropped_ = true;
  texts_.clear();
  bytes_ = 0;
}

bool TextQueue::is_long() {
  const Lock lock(mutex_);
  return bytes_ > kLong_bytes;
}

bool TextQueue::is_starved() {
  const Lock lock(mutex_);
  return reader_waits_;
}

TextQueue::int_type TextQueue::underflow() {
  const auto ready = [this] { return ended_ || !texts_.empty(); };
  for (;;) {
    Lock lock(mutex_);
    if (!ready()) {
      reader_waits_ = true;
      lock.unlock();
      const CpuSlot::Without without(*slots_);
      lock.lock();
      changed_.wait(lock, ready);
      lock.unlock();
      continue;
    }
    if (texts_.empty()) {
      return traits_type::eof();
    }
    current_ = std::move(texts_.front());
    texts_.pop_front();
    bytes_ -= current_.size();
    if (!current_.empty()) {
      break;
    }
  }
  setg(current_.data(), current_.data(), current_.data() + current_.size());
  return traits_type::to_int_type(*gptr());
}

VerifyThread::VerifyThread(const verify::Rules& rules, const verify::Observation& observation,
                           std::string input_name, std::string output_name, CpuSlots& slots)
    : input_(slots),
      output_(slots),
      result_(fail(ErrorKind::internal, "not verified")),
      thread_([this, rules, observation, input_name = std::move(input_name),
               output_name = std::move(output_name), &slots] {
        const CpuSlot slot(slots);
        try {
          std::istream input(&input_);
          std::istream output(&output_);
          result_ =
              verify::verify(input, input_name, output, output_name, rules, stopped_, observation);
        } catch (...) {
          failure_ = std::current_exception();
        }
        // The verification may have ended early, and the rest of a print must not pile up here.
        input_.drop();
        output_.drop();
      }) {}

VerifyThread::~VerifyThread() {
  stopped_.now = true;
  end();
}

void VerifyThread::push(std::string input, std::string output) {
  input_.push(std::move(input));
  output_.push(std::move(output));
}

bool VerifyThread::is_behind() {
  return kHasThreads && (input_.is_long() || output_.is_long()) && !input_.is_starved() &&
         !output_.is_starved();
}

void VerifyThread::end() {
  input_.end();
  output_.end();
}

Result<verify::VerifyReport> VerifyThread::result() {
  thread_.join();
  if (failure_) {
    std::rethrow_exception(failure_);
  }
  return std::move(result_);
}

}  // namespace unflex::flow
