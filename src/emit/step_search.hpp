// The search for lines between whole steps over one stretch of a run.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "line_cost.hpp"
#include "step_ends.hpp"
#include "step_path.hpp"

namespace unflex::emit {

// A line's end, with all lines before it.
template <int kModes>
struct State {
  double total = 0.0;  // cost of the lines so far and to come
  double spent = 0.0;
  ZVector<kModes> z = ZVector<kModes>::Zero();
  Place at{};
  Eigen::Vector2d speed_mm_s = Eigen::Vector2d::Zero();  // of the line that ends here
  double line_s = 0.0;                                   // duration of that line
  std::size_t k = 0;
  std::int32_t parent = -1;
};

// The stretch of one search: from a state to a place.
template <int kModes>
struct Stretch {
  State<kModes> begin;
  std::size_t last = 0;  // the last candidate
  Place end{};
  bool goes_on = false;  // it ends in motion, at `last`
  int lines_after = 0;   // RunEnds::lines_after
};

// The lines' ends on the stretch, its own begin included. Empty if there are no such lines. The
// lines before it began at `lines_before_s`. Only short lines lie across one of the `wanted`
// candidates.
template <int kModes>
[[nodiscard]] Polygon search(const LineCosts<kModes>& costs, const std::vector<std::size_t>& wanted,
                             const Stretch<kModes>& stretch, const StepGrid& grid,
                             const LineRules& rules, const std::vector<double>& lines_before_s);

}  // namespace unflex::emit
