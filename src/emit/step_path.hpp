// Lines between whole motor steps, for firmwares that round every line to them.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/emit/line_rules.hpp"
#include "vertices.hpp"

namespace unflex::emit {

// Where and when the lines of a run end. The first entry is where and when the first line begins.
struct Polygon {
  std::vector<double> times_s;
  Axes<std::vector<double>> places_mm;

  [[nodiscard]] XY place_mm(std::size_t i) const { return {places_mm.x[i], places_mm.y[i]}; }
  void add(const XY& place_mm) {
    for_each_axis([](std::vector<double>& all, double place) { all.push_back(place); }, places_mm,
                  place_mm);
  }
};

// The weight W of an error e of the nozzle at one moment: eᵀWe.
struct ErrorWeight {
  double xx = 1.0;
  double xy = 0.0;
  double yy = 1.0;

  bool operator==(const ErrorWeight&) const = default;
};

// The two ends of a run.
struct RunEnds {
  XY start_mm;
  XY end_mm;
  std::vector<double> lines_before_s = {};  // when the lines before it began, in order, before 0
  int lines_after = 0;   // how many lines begin within rules.burst_s after the run
  bool goes_on = false;  // the run begins in motion
  // Set if the run ends in motion: when it ends. The base is given beyond that.
  std::optional<double> until_s = {};
};

// The lines of at least rules.min_steps of the grid in X or Y that make the nozzle follow the base
// best. A line may be longer or end a few steps further along the path, if that brings its end
// closer to whole steps across it. Only short lines lie across one of the `wanted` times. The last
// line may end before the base does. Returns an empty polygon if there are no such lines.
[[nodiscard]] Polygon step_path(const dynamics::BaseTrajectory& base,
                                const std::vector<double>& wanted,
                                const std::function<ErrorWeight(double)>& weight,
                                const RunEnds& ends, const Axes<AxisGrid>& grid,
                                const LineRules& rules);

}  // namespace unflex::emit
