// Decisions taken from the bytes that fuzzing mutates. After their end, all bytes are zero.
#pragma once

#include <cstddef>
#include <string_view>

#include "text_line.hpp"

namespace unflex::fuzz {

class Bytes {
 public:
  explicit Bytes(std::string_view bytes) : rest_(bytes) {}

  [[nodiscard]] bool empty() const { return rest_.empty(); }
  [[nodiscard]] std::string_view rest() const { return rest_; }

  std::size_t byte() {
    if (rest_.empty()) {
      return 0;
    }
    const auto value = static_cast<unsigned char>(rest_.front());
    rest_.remove_prefix(1);
    return value;
  }
  // One of `count` variants; '0' gives the first.
  std::size_t variant(std::size_t count) {
    return static_cast<unsigned char>(byte() - '0') % count;
  }
  // A number from a grid of 65 536 values.
  double number(double from, double to) {
    const std::size_t high = byte();
    return from + (to - from) * static_cast<double>(256 * high + byte()) / 65535.0;
  }
  // The text up to the next line feed, which is left out.
  std::string_view line() { return testing::take_line(rest_); }

 private:
  std::string_view rest_;
};

}  // namespace unflex::fuzz
