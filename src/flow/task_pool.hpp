// Threads that carry out tasks in the order they come.
#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "cpu_slots.hpp"
#include "unflex/core/threads.hpp"

namespace unflex::flow {

class TaskPool {
 public:
  using Task = std::function<void()>;  // throws nothing

  // Starts `threads` threads, or as many as the system gives. Without any, tasks are carried out
  // where they are submitted.
  TaskPool(unsigned threads, CpuSlots& slots);
  // Finishes the tasks that are under way and drops the others.
  ~TaskPool();
  TaskPool(const TaskPool&) = delete;
  TaskPool& operator=(const TaskPool&) = delete;

  void submit(Task task);

 private:
  void work();

  CpuSlots* slots_;
  Mutex mutex_;
  Condition wake_;
  std::deque<Task> tasks_;
  bool ends_ = false;
  std::vector<Thread> threads_;
};

}  // namespace unflex::flow
