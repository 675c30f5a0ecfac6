#include "base_limits.hpp"

#include <algorithm>
#include <limits>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/kinematics.hpp"
#include "unflex/machine/as_printer.hpp"

namespace unflex::run {
namespace {

// Rounding a line's ends to the grid changes the acceleration from line to line by up to 4 · ½ ·
// grid / T². Rounding F and the firmware's ramps change it by a little more. The base stays that
// far below the limit, so that the text keeps it.
constexpr double kAccelShare = 0.98;
// Where the timing is free the base is at its limit most of the time, so the largest of many errors
// counts.
constexpr double kAccelShareOfFreeTiming = 0.93;

// The largest acceleration at which the lines can follow a base that turns round. In the time of a
// line, this base goes as far as the shortest line is long, at²/2. A quicker base turns where no
// line ends.
double accel_by_turns(const machine::Settings& settings, double asked_mm_s2) {
  // The base leads the nozzle, so it needs more than the sliced moves ask for.
  constexpr double kLeast = 1.4;
  const double shortest_mm = min_line_mm(settings);
  const double line_s = settings.min_line_s();
  return shortest_mm > 0.0 && !settings.is_timing_free()
             ? std::max(2.0 * shortest_mm / (line_s * line_s), kLeast * asked_mm_s2)
             : std::numeric_limits<double>::infinity();
}

}  // namespace

bool shares_motors(const machine::Settings& settings) { return settings.motors().shared_by_xy(); }

double accel_by_lines_mm_s2(const machine::Settings& settings) {
  return machine::grid_mm(settings) <= machine::kGrid_mm
             ? machine::kSpeedStepShare *
                   std::max(settings.emit.max_speed_step_mm_s, settings.least_speed_step_mm_s()) /
                   settings.min_line_s()
             : std::numeric_limits<double>::infinity();
}

double min_line_mm(const machine::Settings& settings) {
  return spec_of(settings.printer.firmware).motion.skips_short_moves
             ? (settings.printer.junctions.min_steps_per_segment + 1.0) * machine::grid_mm(settings)
             : 0.0;
}

double planned_base_accel_mm_s2(const machine::Settings& settings, double asked_mm_s2,
                                bool for_turns) {
  const double shortest_s = settings.min_line_s();
  const double by_turns =
      for_turns ? accel_by_turns(settings, asked_mm_s2) : std::numeric_limits<double>::infinity();
  const double limit = std::min(
      {settings.base_max_accel_mm_s2(asked_mm_s2), accel_by_lines_mm_s2(settings), by_turns});
  const double axes =
      settings.motors().gain_of_both();  // the rounding of X and Y that a motor gets
  const double share = settings.is_timing_free() ? kAccelShareOfFreeTiming : kAccelShare;
  return share * limit -
         std::min(2.0 * axes * machine::grid_mm(settings) / (shortest_s * shortest_s), 0.2 * limit);
}

}  // namespace unflex::run
