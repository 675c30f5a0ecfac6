#include "task_pool.hpp"

#include <exception>
#include <utility>

#include "unflex/core/threads.hpp"

namespace unflex::flow {

TaskPool::TaskPool(unsigned threads, CpuSlots& slots) : slots_(&slots) {
  if (!kHasThreads) {
    return;
  }
  threads_.reserve(threads);
  try {
    for (unsigned i = 0; i < threads; ++i) {
      threads_.emplace_back([this] { work(); });
    }
  } catch (const std::exception&) {
    // The system gives no more threads, or no memory for them. Fewer threads, or none, do as well.
  }
}

TaskPool::~TaskPool() {
  {
    const Lock lock(mutex_);
    ends_ = true;
  }
  wake_.notify_all();
  threads_.clear();
}

void TaskPool::submit(Task task) {
  if (threads_.empty()) {
    task();
    return;
  }
  {
    const Lock lock(mutex_);
    tasks_.push_back(std::move(task));
  }
  wake_.notify_one();
}

void TaskPool::work() {
  for (;;) {
    Task task;
    {
      Lock lock(mutex_);
      wake_.wait(lock, [this] { return ends_ || !tasks_.empty(); });
      if (ends_) {
        return;
      }
      task = std::move(tasks_.front());
      tasks_.pop_front();
    }
    const CpuSlot slot(*slots_);
    task();
  }
}

}  // namespace unflex::flow
