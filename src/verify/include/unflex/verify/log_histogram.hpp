// Histogram over cells whose borders are less than 1 % apart, from 2⁻³⁰ to 2⁷; what lies outside
// falls into the first or last cell. Values are given by their squares, because distances are
// computed as squares.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace unflex::verify {

class LogHistogram {
 public:
  // Adds `weight` to the cell of the value whose square is given.
  void add_square(double square, double weight) {
    if (weights_.empty()) {
      weights_.resize(kCells);
    }
    const std::uint64_t cell = square > kSmallest ? number(square) - kFirst : 0;
    weights_[static_cast<std::size_t>(std::min(cell, kCells - 1))] += weight;
  }

  // The value at which the given fraction of the whole weight is reached, within 1 %. The weight of
  // a cell counts as spread evenly over it. 0 for an empty histogram.
  [[nodiscard]] double quantile(double fraction) const;
  // Total weight of the cells that begin below the value.
  [[nodiscard]] double weight_below(double value) const;

 private:
  // The bits of a double are its exponent and then its mantissa. The exponent and the first six
  // bits of the mantissa number the cells: 64 equal ones per octave of squares, in ascending order.
  static constexpr int kDropped = 52 - 6;
  static constexpr double kSmallest = 0x1p-60;
  static constexpr double kLargest = 0x1p14;

  static constexpr std::uint64_t kFirst = std::bit_cast<std::uint64_t>(kSmallest) >> kDropped;
  static constexpr std::uint64_t kCells =
      (std::bit_cast<std::uint64_t>(kLargest) >> kDropped) - kFirst;

  [[nodiscard]] static std::uint64_t number(double square) {
    return std::bit_cast<std::uint64_t>(square) >> kDropped;
  }

  // Where the cell begins.
  [[nodiscard]] static double border(std::size_t cell);

  std::vector<double> weights_;
};

}  // namespace unflex::verify
