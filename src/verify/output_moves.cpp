#include "output_moves.hpp"

#include <cmath>
#include <utility>

namespace unflex::verify {
namespace {

// A smaller amount is a remainder of rounding, and no line is laid with it.
constexpr double kNothing_mm = 2e-5;

}  // namespace

void OutputFilament::begin_written(const dynamics::HotendPressure& hotend) {
  is_written_ = true;
  hotend_ = PressedFilament(hotend);
  owed_mm_ = 0.0;
}

OutputMove OutputFilament::laid(planner::PlannedMove move) {
  OutputMove result{move, std::move(move)};
  planner::PlannedMove& laid = result.laid;
  if (!is_written_ || !laid.segment.moves_xy()) {
    return result;
  }
  owed_mm_ += hotend_.push(laid.duration_s(), laid.segment.delta(gcode::E));
  const double laid_mm = std::abs(owed_mm_) > kNothing_mm ? owed_mm_ : 0.0;
  owed_mm_ -= laid_mm;
  laid.segment.end_mm[gcode::E] = laid.segment.start_mm[gcode::E] + laid_mm;
  laid.direction[gcode::E] = laid_mm / laid.length_mm;
  return result;
}

}  // namespace unflex::verify
