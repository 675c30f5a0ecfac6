// An array with zeros before its beginning and after its end, so that a stencil may reach over.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <vector>

namespace unflex::compensate {

class Padded {
 public:
  static constexpr std::size_t kPad = 8;

  // Contents are lost. Memory is kept if it suffices.
  void resize(std::size_t size) {
    size_ = size;
    values_.resize(size + 2 * kPad);
    std::fill_n(values_.begin(), kPad, 0.0);
    std::fill_n(values_.begin() + static_cast<std::ptrdiff_t>(kPad + size), kPad, 0.0);
  }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] double* data() { return values_.data() + kPad; }
  [[nodiscard]] const double* data() const { return values_.data() + kPad; }
  double& operator[](std::size_t i) { return values_[i + kPad]; }
  double operator[](std::size_t i) const { return values_[i + kPad]; }

 private:
  std::size_t size_ = 0;
  std::vector<double> values_;
};

inline Eigen::Map<Eigen::ArrayXd> as_array(Padded& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

inline Eigen::Map<const Eigen::ArrayXd> as_array(const Padded& values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

}  // namespace unflex::compensate
