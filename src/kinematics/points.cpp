#include "unflex/kinematics/points.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <optional>

#include "unflex/core/number.hpp"
#include "unflex/core/text.hpp"

namespace unflex::kinematics {
namespace {

constexpr std::array<std::string_view, 6> kColumns = {"qa", "qb", "qc", "x", "y", "z"};
// Where in a row each of the columns is.
using Order = std::array<std::size_t, kColumns.size()>;

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (;;) {
    const std::size_t comma = line.find(',');
    cells.push_back(trimmed(line.substr(0, comma)));
    if (comma == std::string_view::npos) {
      return cells;
    }
    line.remove_prefix(comma + 1);
  }
}

// A header has no number at all; a row with a slip of the pen is no header.
bool is_header(const std::vector<std::string_view>& cells) {
  return std::ranges::none_of(cells,
                              [](std::string_view cell) { return parse_real(cell).has_value(); });
}

Result<Order> order_of(const std::vector<std::string_view>& header, const SourcePlace& place) {
  Order order{};
  for (std::size_t i = 0; i < kColumns.size(); ++i) {
    const auto found = std::ranges::find(header, kColumns[i]);
    if (found == header.end()) {
      return fail(ErrorKind::input, place,
                  fmt::format("its header has no column {}; name the columns qa,qb,qc,x,y,z, or "
                              "leave the header out",
                              kColumns[i]));
    }
    order[i] = static_cast<std::size_t>(found - header.begin());
  }
  return order;
}

Result<Pair> pair_of(const std::vector<std::string_view>& cells, const Order& order,
                     const SourcePlace& place) {
  std::array<double, kColumns.size()> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::optional<double> number =
        order[i] < cells.size() ? parse_real(cells[order[i]]) : std::nullopt;
    if (!number) {
      return fail(ErrorKind::input, place,
                  fmt::format("has no number for {}; write six numbers in mm, qa,qb,qc,x,y,z, with "
                              "points for decimals",
                              kColumns[i]));
    }
    numbers[i] = *number;
  }
  return Pair{.q_mm = {numbers[0], numbers[1], numbers[2]},
              .p_mm = {numbers[3], numbers[4], numbers[5]}};
}

}  // namespace

Result<Points> parse_points(std::string_view text, const std::string& file) {
  Points points;
  Order order{};
  std::iota(order.begin(), order.end(), std::size_t{0});
  bool is_first = true;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.empty() || line.starts_with('#')) {
      continue;
    }
    const std::vector<std::string_view> cells = cells_of(line);
    const SourcePlace place{file, number};
    if (is_first && is_header(cells)) {
      const Result<Order> told = order_of(cells, place);
      if (!told) {
        return tl::unexpected(told.error());
      }
      order = *told;
    } else {
      const Result<Pair> pair = pair_of(cells, order, place);
      if (!pair) {
        return tl::unexpected(pair.error());
      }
      points.pairs.push_back(*pair);
      points.lines.push_back(number);
    }
    is_first = false;
  }
  return points;
}

}  // namespace unflex::kinematics
