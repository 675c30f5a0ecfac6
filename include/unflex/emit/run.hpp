// A compensated run as the emitter gets it, and as the lines that it is cut into.
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

// What a run finds when it begins and has to fit into.
struct RunStart {
  std::array<double, 3> zero_mm{};  // machine position of X0 Y0 Z0 (G92)
  double speed_factor = 1.0;        // M220
  planner::Limits limits;           // as the input has them

  friend bool operator==(const RunStart&, const RunStart&) = default;
};

[[nodiscard]] RunStart run_start(const gcode::ModalState& state, const planner::Limits& limits);

// A compensated run, or a part of one.
struct Run {
  // The input's lines in the run: moves, and passive and limit lines between them.
  const std::vector<gcode::Event>* events = nullptr;
  // For each event the number of planned moves it became, 0 for lines that do not move.
  const std::vector<std::size_t>* move_counts = nullptr;
  const std::vector<planner::PlannedMove>* moves = nullptr;
  const dynamics::BaseTrajectory* base = nullptr;
  double lead_in_s = 0.0;        // the first move starts this long after the base
  double tolerance_share = 1.0;  // of LineRules::tolerance_mm that its lines may use
  double limits_share = 1.0;     // of LineRules' burst_lines and max_accel_mm_s2 that they may use
  std::vector<double> lines_before_s =
      {};               // begins of the lines just before it, in order, before 0
  int lines_after = 0;  // how many lines begin within LineRules::burst_s after it
  // It goes on from another part: there the last line's end is in X and Y, the nearest to the base
  // that can be written unless known better.
  bool goes_on = false;
  std::optional<std::array<double, 2>> from_mm = {};
  double late_s = 0.0;  // by how much its first line begins late
  // When the next part goes on from it. The base, which moves then, is given some time further.
  std::optional<double> until_s = {};

  [[nodiscard]] double end_s() const { return until_s.value_or(base->duration_s()); }
};

// A run cut into lines, for a certain start. Without lines when its motion is too small for one.
struct RunPlan {
  RunStart start;
  std::array<double, 2> from_mm{};  // where the first line begins
  std::shared_ptr<const std::vector<Stroke>> strokes;

  [[nodiscard]] bool empty() const;
};

}  // namespace unflex::emit
