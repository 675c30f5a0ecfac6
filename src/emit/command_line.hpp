// A command that sets limits, word by word.
#pragma once

#include <fmt/core.h>

#include <array>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace unflex::emit {

// NaN is unequal to any wanted limit, so the limit is written.
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

// One command, with only those of its words that have to be sent.
class CommandLine {
 public:
  explicit CommandLine(std::string_view command) : text_(command) {}

  // The value follows the name without anything between, as in X1000; the name may end in "=", as
  // in ACCEL=1000.
  void word(std::string_view name, double wanted, double current, double factor = 1.0) {
    if (wanted != current) {
      // Twelve digits: 0.1 · 60 is 6, not 6.000000000000001.
      text_ += fmt::format(" {}{:.12g}", name, wanted * factor);
      empty_ = false;
    }
  }

  void axes(const std::array<double, 4>& wanted, const std::array<double, 4>& current,
            double factor = 1.0) {
    constexpr std::array<std::string_view, 4> kNames = {"X", "Y", "Z", "E"};
    for (std::size_t axis = 0; axis < kNames.size(); ++axis) {
      word(kNames[axis], wanted[axis], current[axis], factor);
    }
  }

  void finish(std::vector<std::string>& lines) {
    if (!empty_) {
      lines.push_back(std::move(text_));
    }
  }

 private:
  std::string text_;
  bool empty_ = true;
};

}  // namespace unflex::emit
