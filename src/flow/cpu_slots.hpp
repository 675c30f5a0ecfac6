// No more threads compute at once than the user allows; the others wait for a slot.
#pragma once

#include <algorithm>

#include "unflex/core/threads.hpp"

namespace unflex::flow {

// Not a std::counting_semaphore: the one in libstdc++ 12.2 may sleep for ever though a slot is free
// (GCC bug 104928).
class CpuSlots {
 public:
  explicit CpuSlots(unsigned count) : free_(std::max(count, 1U)) {}

  void take() {
    Lock lock(mutex_);
    given_.wait(lock, [this] { return free_ > 0; });
    --free_;
  }
  void give() {
    {
      const Lock lock(mutex_);
      ++free_;
    }
    given_.notify_one();
  }

 private:
  Mutex mutex_;
  Condition given_;
  unsigned free_;
};

// Holds a slot. `Without` gives the holder's slot back for a while.
class CpuSlot {
 public:
  explicit CpuSlot(CpuSlots& slots) : slots_(&slots) { slots_->take(); }
  ~CpuSlot() { slots_->give(); }
  CpuSlot(const CpuSlot&) = delete;
  CpuSlot& operator=(const CpuSlot&) = delete;

  class Without {
   public:
    explicit Without(CpuSlots& slots) : slots_(&slots) { slots_->give(); }
    ~Without() { slots_->take(); }
    Without(const Without&) = delete;
    Without& operator=(const Without&) = delete;

   private:
    CpuSlots* slots_;
  };

 private:
  CpuSlots* slots_;
};

}  // namespace unflex::flow
