#include "filament_flow.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/math.hpp"

namespace unflex::emit {
namespace {

using gcode::X;
using gcode::Y;
using gcode::Z;

// Share of the firmware's limit that we use: E is rounded to five digits, and lines are a little
// faster than their length and time say.
constexpr double kOfLimit = 0.9;
// The most sweeps over the lines. Each sweep moves an excess one line further.
constexpr int kMostSweeps = 200;
// Sweeping ends when no jump exceeds this share of the limit.
constexpr double kSettled = 1.01;

}  // namespace

double most_flow_step_mm_s(const planner::FirmwareConfig& firmware) {
  return spec_of(firmware.firmware).motion.limits_extruder
             ? kOfLimit * firmware.instantaneous_corner_velocity_mm_s
             : std::numeric_limits<double>::infinity();
}

double drawing_back_mm_s2(const planner::FirmwareConfig& firmware) {
  return spec_of(firmware.firmware).motion.limits_extruder
             ? firmware.max_extrude_only_accel_mm_s2
             : std::numeric_limits<double>::infinity();
}

void level_flow(const gcode::Position& start_mm, double most_mm_s, std::span<Stroke> strokes) {
  if (!(most_mm_s > 0.0) || std::isinf(most_mm_s)) {
    return;
  }
  struct LineFlow {
    double length_mm;
    double speed_mm_s;
    double filament_mm;
  };
  std::vector<LineFlow> lines;
  Stroke before{0.0, xy_of(start_mm), start_mm[Z]};
  for (const Stroke& stroke : strokes) {
    const double length =
        math::hypot(distance(before.place_mm, stroke.place_mm), stroke.z_mm - before.z_mm);
    lines.push_back({length, length / (stroke.end_s - before.end_s), stroke.e_mm - before.e_mm});
    before = stroke;
  }
  bool settled = false;
  for (int sweep = 0; sweep < kMostSweeps && !settled; ++sweep) {
    settled = true;
    for (std::size_t number = 1; number < lines.size(); ++number) {
      // Sweeps go forwards and backwards in turn.
      const std::size_t i = sweep % 2 == 0 ? number : lines.size() - number;
      LineFlow& a = lines[i - 1];
      LineFlow& b = lines[i];
      if (!(a.length_mm > 0.0 && b.length_mm > 0.0)) {
        continue;
      }
      const double jump = b.filament_mm / b.length_mm - a.filament_mm / a.length_mm;
      const double most = most_mm_s / std::min(a.speed_mm_s, b.speed_mm_s);
      if (std::abs(jump) <= kSettled * most) {
        continue;
      }
      const double moved =
          std::copysign((std::abs(jump) - most), jump) / (1.0 / a.length_mm + 1.0 / b.length_mm);
      a.filament_mm += moved;
      b.filament_mm -= moved;
      settled = false;
    }
  }
  double laid_mm = 0.0;
  for (std::size_t i = 0; i + 1 < strokes.size(); ++i) {
    laid_mm += lines[i].filament_mm;
    strokes[i].e_mm = laid_mm;
  }
}

}  // namespace unflex::emit
