// A compensated run as the emitter gets it, and the lines that it is cut into.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::emit {

struct Stroke;  // a line to be, see src/emit/strokes.hpp

// The state of the printer in which a run begins.
struct RunStart {
  std::array<double, 3> zero_mm{};  // machine position of X0 Y0 Z0 (G92)
  double speed_factor = 1.0;        // M220
  planner::Limits limits;           // as the input has them
  // Marlin: what E reads is known, so it is set to 0 before the first line.
  bool zeroes_e = false;
  gcode::PressureAdvance advance = {};

  friend bool operator==(const RunStart&, const RunStart&) = default;
};

[[nodiscard]] RunStart run_start(Firmware firmware, const gcode::ModalState& state,
                                 const planner::Limits& limits);

// Accelerations of a run whose plan asks for more than the printer's own limits; 0: EmitOptions has
// them.
struct RunAccel {
  double base_mm_s2 = 0.0;   // LineRules::max_accel_mm_s2
  double lines_mm_s2 = 0.0;  // EmitOptions::line_accel_mm_s2, and the firmware's own limits
};

// A compensated run, or a part of one.
struct Run {
  // The input's lines in the run: moves, and passive and limit lines between them.
  const std::vector<gcode::Event>* events = nullptr;
  // For each event the number of planned moves it became, 0 for lines that do not move.
  const std::vector<std::size_t>* move_counts = nullptr;
  const std::vector<planner::PlannedMove>* moves = nullptr;
  const dynamics::BaseTrajectory* base = nullptr;
  double lead_in_s = 0.0;        // the first move starts this long after the base
  double tolerance_share = 1.0;  // share of LineRules::tolerance_mm that its lines may use
  double limits_share = 1.0;     // share of LineRules' burst_lines and max_accel_mm_s2 to use
  RunAccel accel = {};
  // When the lines just before the run began, in order. The run begins at 0.
  std::vector<double> lines_before_s = {};
  int lines_after = 0;  // how many lines begin within LineRules::burst_s after the run
  // This part continues the previous one. `from_mm` is the place where the previous part ended.
  // Unset: the grid point nearest to the base.
  bool goes_on = false;
  std::optional<XY> from_mm = {};
  double late_s = 0.0;  // how late its first line begins
  // The motion just before the run, if the machine does not stop between the two: filament or Z
  // alone.
  std::optional<gcode::Segment> kept_before = {};
  // When the next part takes over. The base still moves then, and is given for some time beyond it.
  std::optional<double> until_s = {};

  [[nodiscard]] double end_s() const { return until_s.value_or(base->duration_s()); }
};

// A run cut into lines, for a certain start. It has no lines if its motion is too small for one.
struct RunPlan {
  RunStart start;
  XY from_mm;  // where the first line begins
  std::shared_ptr<const std::vector<Stroke>> strokes;

  [[nodiscard]] bool empty() const;
};

}  // namespace unflex::emit
