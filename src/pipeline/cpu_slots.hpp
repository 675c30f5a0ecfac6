// As many threads may compute at once as the user allows; the others wait for a slot.
#pragma once

#include <algorithm>
#include <cstddef>
#include <semaphore>

namespace unflex::pipeline {

class CpuSlots {
 public:
  explicit CpuSlots(unsigned count) : free_(static_cast<std::ptrdiff_t>(std::max(count, 1U))) {}

  void take() { free_.acquire(); }
  void give() { free_.release(); }

 private:
  std::counting_semaphore<> free_;
};

// Holds a slot, or, as `Without`, gives the holder's back for a while.
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

}  // namespace unflex::pipeline
