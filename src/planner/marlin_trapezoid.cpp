// Source: Marlin 2.1.2, src/module/planner.cpp, Planner::calculate_trapezoid_for_block, and
// stepper.cpp, Stepper::block_phase_isr, which uses its numbers.
//
//   r_i, r_n, r_f   initial, nominal and final rate, steps/s     a   acceleration, steps/s²
//   N_a, N_d        steps of the ramps up and down               N   steps of the block
#include "marlin_trapezoid.hpp"

#include <algorithm>
#include <cmath>

#include "marlin_integers.hpp"

namespace unflex::planner::marlin {
namespace {

// MINIMAL_STEP_RATE, steps/s.
constexpr std::uint32_t kMinRate = 120;

float square(float x) { return x * x; }
double square(double x) { return x * x; }

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

// The interrupt accelerates from r_i for N_a steps, though not above r_n, keeps the rate it
// reached, and decelerates from there for the last N_d steps. If r_n is below the minimum of r_i,
// all but the first step is at r_n.
//
// It accelerates from step to step, by the time that has passed, and the first step is made at r_i.
// A ramp of many steps is nearly continuous. A ramp much shorter than the first step is none: that
// step takes 1 / r_i, all others 1 / r_n.
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
}

}  // namespace unflex::planner::marlin

namespace unflex::planner {

double first_step_s(const FirmwareConfig& config) {
  return config.firmware == Firmware::marlin ? 1.0 / marlin::kMinRate : 0.0;
}

double wait_s(const PlannedMove& first, const FirmwareConfig& config) {
  constexpr double kRounding_s = 1e-9;
  const double longest_s = first_step_s(config);
  return longest_s > 0.0 && first.lead_s > longest_s - kRounding_s ? longest_s : 0.0;
}

}  // namespace unflex::planner
