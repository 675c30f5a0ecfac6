// How the base's motion is cut into lines.
#pragma once

#include <algorithm>
#include <limits>

#include "unflex/core/kinematics.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/frequency_field.hpp"

namespace unflex::emit {

// The range of places that an axis may have.
struct Reach {
  double min_mm = -std::numeric_limits<double>::infinity();
  double max_mm = std::numeric_limits<double>::infinity();
};

struct LineRules {
  Axes<dynamics::FlexibleAxis> nozzle;  // what hangs on the base
  // How its frequencies change over the bed. It counts where filament is laid. Lines differ so
  // little from the base that the frequencies given serve all of a run.
  dynamics::FieldXY field;
  // The frequencies may be off by this share, up and down. Lines between whole steps are chosen to
  // suit nozzles that are off by it. 0: the frequencies are exact.
  double freq_error = 0.0;
  Axes<Reach> reach;
  double tolerance_mm = 3e-4;  // largest nozzle error that one line may cause
  double min_line_s = 1e-3;    // shortest duration of a line
  double min_line_mm = 0.0;    // shortest length of a line along X or Y
  int min_steps = 1;  // fewest grid steps of a line; the firmware joins shorter lines to the next
  double first_step_s = 0.0;  // planner::first_step_s()
  // The firmware makes the first step of a line at the speed of the line before, if that is slower
  // (planner::PlannedMove::lead_s).
  bool leads = false;
  double max_line_s = 0.05;
  // If the firmware rounds to whole steps, single lines may be as short as min_line_s. But no more
  // than burst_lines begin within any burst_s, lines before and after the run counted. 0: no limit.
  int burst_lines = 0;
  double burst_s = 0.1;
  // Largest change of a motor's speed from line to line, where lines can be short enough.
  double max_speed_step_mm_s = 30.0;
  // Limit of the motors: change of speed divided by the time between the middles of two lines.
  double max_accel_mm_s2 = 20000.0;
  Motors motors;

  // The shortest duration that the lines of an endless row of equal lines may have.
  [[nodiscard]] double even_line_s() const {
    return burst_lines > 0 ? std::max(min_line_s, burst_s / burst_lines) : min_line_s;
  }
};

}  // namespace unflex::emit
