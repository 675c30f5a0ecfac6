#include "sparkline.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "unflex/core/math.hpp"

namespace unflex::app {

std::string number_text(double value, double width) {
  const double wide = std::max(width, 1e-9 * std::abs(value));
  const int decimals = std::clamp(static_cast<int>(std::ceil(1.0 - math::log10(wide))), 0, 5);
  return fmt::format("{:.{}f}", value, decimals);
}

std::string sparkline(const std::vector<double>& values, double least, double most) {
  constexpr std::array<std::string_view, 8> kBlocks = {"▁", "▂", "▃", "▄", "▅", "▆", "▇", "█"};
  constexpr std::size_t kColumns = 64;
  const std::size_t columns = std::min(kColumns, values.size());
  std::string line;
  for (std::size_t column = 0; column < columns; ++column) {
    const std::size_t from = column * values.size() / columns;
    const std::size_t to = std::max(from + 1, (column + 1) * values.size() / columns);
    double sum = 0.0;
    for (std::size_t i = from; i < to; ++i) {
      sum += values[i];
    }
    const double share = (sum / static_cast<double>(to - from) - least) / (most - least);
    line += kBlocks[static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * 7.0 + 0.5)];
  }
  return line;
}

}  // namespace unflex::app
