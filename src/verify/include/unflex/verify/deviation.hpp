// How far a nozzle strays from a path.
//
// Notation (docs/theory.md):
//   r(t)  reference: the firmware's plan of the sliced file     b(t)  base     p(t)  nozzle
//   contour error   distance in the XY plane from p(t) to the part of the sliced path that the
//                   reference passes within ±τ of t (a part passes close to itself elsewhere)
//   tracking error  |p(t) − r(t)| in the XY plane, at the same time
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/mode_frame.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/log_histogram.hpp"
#include "unflex/verify/machine_change.hpp"
#include "unflex/verify/measured.hpp"

namespace unflex::verify {

// Gathers samples, given by the squares of their errors.
class DeviationAccumulator {
 public:
  void add(double contour2_mm2, double tracking2_mm2, double weight_s, std::size_t line) {
    add(contour2_mm2, contour2_mm2, tracking2_mm2, tracking2_mm2, weight_s, line);
  }
  // The mean and the largest of a stretch of time.
  void add(double contour2_mm2, double contour2_max_mm2, double tracking2_mm2,
           double tracking2_max_mm2, double weight_s, std::size_t line) {
    contour_s_.add_square(contour2_mm2, weight_s);
    sum_contour2_ += weight_s * contour2_mm2;
    sum_tracking2_ += weight_s * tracking2_mm2;
    weight_s_ += weight_s;
    tracking2_max_ = std::max(tracking2_max_, tracking2_max_mm2);
    if (contour2_max_mm2 > contour2_max_) {
      contour2_max_ = contour2_max_mm2;
      line_ = line;
    }
  }
  [[nodiscard]] DeviationStats stats() const;

 private:
  LogHistogram contour_s_;  // time per cell
  double sum_contour2_ = 0.0;
  double sum_tracking2_ = 0.0;
  double weight_s_ = 0.0;
  double contour2_max_ = 0.0;
  double tracking2_max_ = 0.0;
  std::size_t line_ = 0;
};

// The model the nozzle hangs on and how finely it is integrated.
struct NozzleModel : Axes<dynamics::FlexibleAxis> {
  // Longest time between two looks. Looks are also taken where acceleration changes.
  double step_s = 5e-4;
  double hold_s = 0.5;  // how long the base is held after the end of the file
  // Where modes do not lie along the axes, this is what the nozzle hangs on. The axes are then what
  // each of them shows of the modes.
  std::optional<dynamics::ModeFrame> frame = {};
};

// The model with a step just fine enough to compare two motions: 20 steps per period of the faster
// axis.
[[nodiscard]] NozzleModel coarse(NozzleModel model);

using dynamics::NozzleXY;

// The nozzle of a base that has long been in even motion.
[[nodiscard]] NozzleXY riding(const NozzleModel& model, const XY& place_mm,
                              const XY& velocity_mm_s = {});

// Distance between two nozzle states, in mm. Velocities count divided by ω.
[[nodiscard]] double apart_mm(const NozzleXY& a, const NozzleXY& b, const NozzleModel& model);

// How far the nozzle will swing around a base that rests at `at`.
[[nodiscard]] double swing_mm(const NozzleXY& nozzle, const gcode::Position& at,
                              const NozzleModel& model);

// The error that a run causes: how far the nozzle strays while the run draws, and the swing that it
// leaves. The swing counts as if the moves that follow drew with it. c is the contour error.
struct RunError {
  double rms_mm = 0.0;  // √((∫ c² dt + A²/(4ζω)) / T); A, the swing, rings out as e^{−ζωt}
  double max_mm = 0.0;  // the larger of max c and A
};

// contour2_mm2_s: ∫ c² dt over duration_s, T.
[[nodiscard]] RunError run_error(double contour2_mm2_s, double contour_max_mm, double duration_s,
                                 double swing_mm, const NozzleModel& model);

struct RunDeviation {
  DeviationAccumulator extruding;
  DeviationAccumulator all;
  NozzleXY end;  // nozzle at the end of the base's motion
  XY base_end_mm;
};

// Integrates the nozzle while the base makes the moves `base`, and measures it against the path and
// plan of `reference`. The base starts lead_in_s before the reference (negative: after it), and
// `start` is the nozzle's state then. If the base takes longer, nothing is measured after the end
// of the reference. If the base ends first, it rests until the reference ends. goes_on: nothing is
// measured after the base's last move.
[[nodiscard]] RunDeviation measure(const std::vector<planner::PlannedMove>& reference,
                                   const std::vector<planner::PlannedMove>& base, NozzleXY start,
                                   const NozzleModel& model, const MachineChange& change = {},
                                   double lead_in_s = 0.0, bool goes_on = false);

}  // namespace unflex::verify
