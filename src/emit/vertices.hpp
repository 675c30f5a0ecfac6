// Where the lines of a run meet.
#pragma once

#include <limits>
#include <vector>

#include "followed.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/emit/line_rules.hpp"

namespace unflex::emit {

// The places that a vertex of one axis can have: offset + integer · step.
struct AxisGrid {
  double offset_mm = 0.0;
  double step_mm = 1e-4;

  [[nodiscard]] double nearest(double position_mm) const;
  // Whether rounding to the grid limits accuracy.
  [[nodiscard]] bool is_coarse() const { return step_mm > 1e-3; }
};
[[nodiscard]] inline XY nearest(const Axes<AxisGrid>& grid, const XY& place_mm) {
  return map_axes([](const AxisGrid& axis, double at_mm) { return axis.nearest(at_mm); }, grid,
                  place_mm);
}

// Whether the base rests where the lines begin and end.
struct Ends {
  bool from_rest = true;
  bool to_rest = true;
};

// The most that an axis' speed may change where two lines join: step_mm_s, and accel_mm_s2 times
// the time between the lines' middles.
struct SpeedSteps {
  double step_mm_s = std::numeric_limits<double>::infinity();
  double accel_mm_s2 = std::numeric_limits<double>::infinity();
  // In place of both, the most at each line's begin and at the last line's end. Empty: none.
  std::vector<double> at_mm_s = {};
};

// One axis at the ends of the lines.
struct AxisVertices {
  std::vector<double> position_mm;
  // At each vertex: the nozzle that follows the polygon, minus the nozzle that follows the base.
  std::vector<double> nozzle_error_mm;
};

// Chooses the vertices of one axis of a run. Vertices on the base's curve would not do: a chord
// lies inside the curve, off by b̈T²/12 on average, and the nozzle follows the chord. So we choose
// them such that the nozzle follows the polygon as it would follow the base, rounding to the grid
// included.
class VertexChooser {
 public:
  VertexChooser(const dynamics::BaseTrajectory& base, std::size_t axis,
                const dynamics::FlexibleAxis& nozzle);

  // For lines that end at times[1], times[2] …. The first and the last vertex are the base's own,
  // the others lie on the grid. No vertex goes further out than `reach` or the base itself. No
  // change of speed, from line to line or to rest, exceeds `most` by more than a little, unless the
  // base's own does.
  [[nodiscard]] AxisVertices choose(const std::vector<double>& times, const AxisGrid& grid,
                                    const Reach& reach, const SpeedSteps& most,
                                    Ends ends = {}) const;

 private:
  const dynamics::BaseTrajectory* base_;
  std::size_t axis_;
  dynamics::FlexibleAxis nozzle_;
  Followed followed_;
};

}  // namespace unflex::emit
