// How far a nozzle is from the path of a run.
#pragma once

#include <cstddef>
#include <vector>

#include "unflex/core/xy.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::study {

// Half a period of the slowest mode of a nozzle, and some room: the reach of the verifier.
[[nodiscard]] double reach_of(double slowest_rad_s);

// Measures against the part of the path that the plan passes within ±reach of the given time, since
// the path may pass close to itself elsewhere. The part consists of whole moves.
class ContourGauge {
 public:
  ContourGauge(const std::vector<planner::PlannedMove>& moves, double reach_s);

  struct Reading {
    double distance_mm = 0.0;
    bool extruding = false;  // the plan lays filament at this time
  };
  // Times must not decrease from call to call.
  [[nodiscard]] Reading measure(double time_s, const XY& place_mm);

 private:
  struct Edge {
    double start_s = 0.0;
    double end_s = 0.0;
    XY from_mm;
    XY direction;
    double length_mm = 0.0;
    bool extruding = false;
  };
  std::vector<Edge> edges_;
  double reach_s_;
  std::size_t first_ = 0;
  std::size_t end_ = 0;
  std::size_t current_ = 0;
};

}  // namespace unflex::study
