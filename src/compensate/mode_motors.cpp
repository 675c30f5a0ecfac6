// Each mode is solved with the limits that it has while the others rest. Where the motors would
// then break theirs, each motor's limit is shared out evenly among the modes that it moves, and all
// are solved again. That is safe, though not tight.
#include "mode_motors.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace unflex::compensate {
namespace {

// Less than this share of a motor is rounding.
constexpr double kNothing = 1e-9;
// A relative excess up to this is rounding.
constexpr double kSlack = 1e-6;

using Modes = std::array<const dynamics::AxisTrajectory*, dynamics::ModeFrame::kCount>;

bool keeps(const ModeMotors& motors, const Modes& modes,
           std::vector<double> dynamics::AxisTrajectory::*nodes, double limit) {
  for (std::size_t k = 0; k < (modes[0]->*nodes).size(); ++k) {
    for (const auto& motor : motors.by_modes) {
      double sum = 0.0;
      for (std::size_t j = 0; j < modes.size(); ++j) {
        sum += motor[j] * (modes[j]->*nodes)[k];
      }
      if (std::abs(sum) > (1.0 + kSlack) * limit) {
        return false;
      }
    }
  }
  return true;
}

// The largest motion of mode j for which the motors have room if each mode has its share.
double share_of(const ModeMotors& motors, std::size_t j) {
  double most = std::numeric_limits<double>::infinity();
  for (const auto& motor : motors.by_modes) {
    const auto moved =
        std::ranges::count_if(motor, [](double part) { return std::abs(part) > kNothing; });
    if (std::abs(motor[j]) > kNothing) {
      most = std::min(most, 1.0 / (static_cast<double>(moved) * std::abs(motor[j])));
    }
  }
  return most;
}

}  // namespace

AxisSolutions solve_modes(const Engine& engine, RunWindow& window) {
  const auto solve_all_modes = [&] {
    AxisSolutions solutions{
        map_axes([&](const AxisWindow& axis) { return engine.solve(axis); }, window)};
    solutions.third = engine.solve(*window.third);
    return solutions;
  };
  AxisSolutions solutions = solve_all_modes();
  if (!window.motors || !solutions.x || !solutions.y || !*solutions.third) {
    return solutions;
  }
  const ModeMotors& motors = *window.motors;
  const Modes modes = {&solutions.x->base, &solutions.y->base, &(*solutions.third)->base};
  if (keeps(motors, modes, &dynamics::AxisTrajectory::accel_mm_s2, motors.max_accel_mm_s2) &&
      keeps(motors, modes, &dynamics::AxisTrajectory::velocity_mm_s, motors.max_velocity_mm_s)) {
    return solutions;
  }
  const std::array<AxisWindow*, 3> windows = {&window.x, &window.y, &*window.third};
  for (std::size_t j = 0; j < windows.size(); ++j) {
    BaseLimits& limits = windows[j]->limits;
    limits.max_velocity_mm_s = share_of(motors, j) * motors.max_velocity_mm_s;
    limits.max_accel_mm_s2 = share_of(motors, j) * motors.max_accel_mm_s2;
  }
  return solve_all_modes();
}

}  // namespace unflex::compensate
