// Numbers for lanes, which load fastest from places that are multiples of a register's size.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "unflex/core/lanes.hpp"

namespace unflex::compensate {

class LaneArray {
 public:
  LaneArray() = default;
  // The numbers begin where the memory lets them.
  LaneArray(const LaneArray&) = delete;
  LaneArray& operator=(const LaneArray&) = delete;
  LaneArray(LaneArray&&) = default;
  LaneArray& operator=(LaneArray&&) = default;
  ~LaneArray() = default;

  // Contents are lost. Memory is kept if it suffices.
  void resize(std::size_t size) {
    if (memory_.size() < size + kLanes) {
      memory_.resize(size + kLanes);
    }
    size_ = size;
    constexpr std::size_t kRegister = kLanes * sizeof(double);
    const std::size_t beyond = reinterpret_cast<std::uintptr_t>(memory_.data()) % kRegister;
    begin_ = memory_.data() + (beyond > 0 ? (kRegister - beyond) / sizeof(double) : 0);
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] double* data() { return begin_; }
  [[nodiscard]] const double* data() const { return begin_; }
  double& operator[](std::size_t i) { return begin_[i]; }
  double operator[](std::size_t i) const { return begin_[i]; }

 private:
  std::vector<double> memory_;
  double* begin_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace unflex::compensate
