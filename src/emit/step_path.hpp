// Lines between whole motor steps, for firmwares that round every line to them.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/emit/line_rules.hpp"
#include "vertices.hpp"

namespace unflex::emit {

// Where the lines of a run end, and when; the first entry is where and when the first one begins.
struct Polygon {
  std::vector<double> times_s;
  std::vector<double> x_mm;
  std::vector<double> y_mm;
};

// What a nozzle that is off by e counts at one moment: eᵀWe.
struct ErrorWeight {
  double xx = 1.0;
  double xy = 0.0;
  double yy = 1.0;

  bool operator==(const ErrorWeight&) const = default;
};

// What a run begins and ends with.
struct RunEnds {
  double start_x_mm = 0.0;
  double start_y_mm = 0.0;
  double end_x_mm = 0.0;
  double end_y_mm = 0.0;
  std::vector<double> lines_before_s = {};  // when the lines before it began, in order, before 0
  int lines_after = 0;                      // how many begin within rules.burst_s after it
  bool goes_on = false;                     // it begins in motion
  // When it ends in motion; the base is given further.
  std::optional<double> until_s = {};
};

// The lines of at least rules.min_steps of `x` or `y` that make the nozzle follow the base best: a
// line may be longer or end a few steps further along the path if that brings its end closer to
// whole steps across it. Only short lines lie across one of the `wanted` times; the last line may
// end before the base does. Empty if there is no such line.
[[nodiscard]] Polygon step_path(const dynamics::BaseTrajectory& base,
                                const std::vector<double>& wanted,
                                const std::function<ErrorWeight(double)>& weight,
                                const RunEnds& ends, const AxisGrid& x, const AxisGrid& y,
                                const LineRules& rules);

}  // namespace unflex::emit
