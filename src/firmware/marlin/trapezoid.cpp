// Source: Marlin 2.1.2, src/module/planner.cpp, Planner::calculate_trapezoid_for_block, and
// stepper.cpp, Stepper::block_phase_isr, which uses its numbers.
//
//   r_i, r_n, r_f   initial, nominal and final rate, steps/s     a   acceleration, steps/s²
//   N_a, N_d        steps of the ramps up and down               N   steps of the block
#include <algorithm>
#include <cmath>
#include <utility>

#include "marlin_integers.hpp"
#include "marlin_trapezoid.hpp"
#include "unflex/core/firmware_spec.hpp"

namespace unflex::planner::marlin {
namespace {

float square(float x) { return x * x; }
double square(double x) { return x * x; }

// The steps of a ramp.
struct Ramp {
  std::uint32_t steps = 0;
  double duration_s = 0.0;

  void add(double rate_steps_s) {
    ++steps;
    duration_s += 1.0 / rate_steps_s;
  }
  // An even ramp of these steps and this duration has rate_steps_s at one end. Gives the rate at
  // its other end.
  [[nodiscard]] double other_end(double rate_steps_s) const {
    return std::max(2.0 * steps / duration_s - rate_steps_s, 0.0);
  }
};

std::uint32_t rate(const Block& block, float factor) {
  const float exact = static_cast<float>(block.nominal_rate_steps_s) * factor;
  return std::max(to_unsigned(std::ceil(exact)), kMinRate);
}

}  // namespace

Trapezoid make_trapezoid(const Block& block, float entry, float exit) {
  const float inverse_nominal = 1.0F / block.nominal_speed_mm_s;
  Trapezoid result;
  result.initial_rate = rate(block, entry * inverse_nominal);
  result.final_rate = rate(block, exit * inverse_nominal);
  if (block.accel_steps_s2 == 0) return result;

  const float half_inverse_accel = 0.5F * (1.0F / static_cast<float>(block.accel_steps_s2));
  const float nominal2 = square(static_cast<float>(block.nominal_rate_steps_s));
  const float accel =
      half_inverse_accel * (nominal2 - square(static_cast<float>(result.initial_rate)));
  const float decel =
      half_inverse_accel * (nominal2 - square(static_cast<float>(result.final_rate)));
  result.accel_steps = to_unsigned(std::ceil(accel));
  result.decel_steps = to_unsigned(std::floor(decel));
  if (std::uint64_t{result.accel_steps} + result.decel_steps > block.step_events) {
    // The nominal rate is out of reach: accelerate up to where the ramps meet.
    const float meet = std::ceil((static_cast<float>(block.step_events) + accel - decel) * 0.5F);
    result.accel_steps = std::min(to_unsigned(meet), block.step_events);
    result.decel_steps = block.step_events - result.accel_steps;
  }
  return result;
}

// The trapezoid as it is planned: an even ramp from r_i for N_a steps, though not above r_n, an
// even rate, and an even ramp from there for the last N_d steps.
void set_profile(const Trapezoid& trapezoid, Block& block) {
  PlannedMove& move = block.move;
  const double mm_per_step = move.length_mm / block.step_events;
  const double a = block.accel_steps_s2;
  const double nominal = block.nominal_rate_steps_s;
  const double initial = std::min<double>(trapezoid.initial_rate, nominal);
  const double peak =
      std::min(nominal, std::sqrt(square(initial) + 2.0 * a * trapezoid.accel_steps));
  const double last = std::sqrt(std::max(square(peak) - 2.0 * a * trapezoid.decel_steps, 0.0));
  move.start_v_mm_s = initial * mm_per_step;
  move.cruise_v_mm_s = peak * mm_per_step;
  move.end_v_mm_s = last * mm_per_step;
  move.accel_mm_s2 = a * mm_per_step;
  double cruise_steps = block.step_events;
  if (a > 0.0) {
    move.decel_s = (peak - last) / a;
    cruise_steps -= 0.5 * (peak + last) * move.decel_s;
    constexpr double kJump = 0.25;  // share of the first step's time
    move.accel_s = (peak - initial) / a;
    if (move.accel_s > 0.0 && move.accel_s * initial < kJump) {
      move.lead_s = 1.0 / initial;
      move.accel_s = 0.0;
      cruise_steps -= 1.0;
    } else {
      cruise_steps -= 0.5 * (peak + initial) * move.accel_s;
    }
  }
  move.cruise_s = std::max(cruise_steps, 0.0) / peak;
  move.block = {.step_events = block.step_events,
                .accel_steps_s2 = block.accel_steps_s2,
                .nominal_rate_steps_s = block.nominal_rate_steps_s,
                .initial_rate_steps_s = trapezoid.initial_rate,
                .final_rate_steps_s = trapezoid.final_rate,
                .accel_steps = trapezoid.accel_steps,
                .decel_steps = trapezoid.decel_steps};
}

namespace {

// The interrupt sets the time of each step but the first when the step before it is made:
//
//   step 1                      1 / r_i
//   steps 2 to N_a + 1          1 / r,  r = min(r_n, r_i + a T), T the time since the beginning
//   the last N_d − 1 steps      1 / r,  r = max(r_f, r_p − a D), D the time since the first of them
//   the others                  1 / r_n
//
// r_p is the rate reached before. So the first step counts as time of acceleration, behind which
// the rate leaps to r_i + a / r_i. Out of a standstill that is 8.3 ms.
//
// Each ramp becomes an even one of the same steps and the same time.
PlannedMove played(PlannedMove move) {
  const StepBlock& block = move.block;
  const double mm_per_step = move.length_mm / block.step_events;
  const double a = block.accel_steps_s2;
  const double nominal = block.nominal_rate_steps_s;
  const double initial = std::min<double>(block.initial_rate_steps_s, nominal);
  const std::uint32_t behind_first = block.step_events - 1;
  const std::uint32_t most_up = std::min(block.accel_steps, behind_first);
  const bool leads = a > 0.0 && most_up > 0 && initial < nominal;
  Ramp up;
  double reached = initial;
  for (double passed_s = 1.0 / initial; leads && up.steps < most_up && reached < nominal;) {
    reached = std::min(nominal, initial + a * passed_s);
    if (reached < nominal) {
      up.add(reached);
      passed_s += 1.0 / reached;
    }
  }
  Ramp down;
  const std::uint32_t most_down =
      std::min(std::max(block.decel_steps, 1U) - 1, behind_first - up.steps);
  const double final_rate = std::min<double>(block.final_rate_steps_s, reached);
  while (down.steps < most_down) {
    down.add(std::max(final_rate, reached - a * down.duration_s));
  }
  const std::uint32_t even = block.step_events - (leads ? 1 : 0) - up.steps - down.steps;
  const double ramp_begin = up.steps > 0 ? up.other_end(reached) : reached;
  const double ramp_end = down.steps > 0 ? down.other_end(reached) : reached;
  move.has_whole_steps = true;
  move.accel_mm_s2 = a * mm_per_step;
  move.start_v_mm_s = initial * mm_per_step;
  move.cruise_v_mm_s = reached * mm_per_step;
  move.end_v_mm_s = ramp_end * mm_per_step;
  move.lead_s = leads ? 1.0 / initial : 0.0;
  move.leap_mm_s = leads ? (ramp_begin - initial) * mm_per_step : 0.0;
  move.accel_s = up.duration_s;
  move.decel_s = down.duration_s;
  move.cruise_s = even / reached;
  return move;
}

}  // namespace

}  // namespace unflex::planner::marlin

namespace unflex::planner {

PlannedMove as_played(PlannedMove move) {
  return move.block.step_events > 0 ? marlin::played(std::move(move)) : move;
}

std::size_t Planner::take_played(std::vector<PlannedMove>& out) {
  const std::size_t count = take(out);
  for (auto move = out.end() - static_cast<std::ptrdiff_t>(count); move != out.end(); ++move) {
    *move = as_played(std::move(*move));
  }
  return count;
}

double first_step_s(const FirmwareConfig& config) {
  return spec_of(config.firmware).motion.first_step_s;
}

double wait_s(const PlannedMove& first, const FirmwareConfig& config) {
  constexpr double kRounding_s = 1e-9;
  const double longest_s = first_step_s(config);
  return longest_s > 0.0 && first.lead_s > longest_s - kRounding_s ? longest_s : 0.0;
}

}  // namespace unflex::planner
