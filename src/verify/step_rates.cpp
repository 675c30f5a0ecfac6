#include "unflex/verify/step_rates.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "rounding.hpp"

namespace unflex::verify {
namespace {

constexpr std::size_t kFilament = Motors::kCount;
// A motor that is slower than this stands still.
constexpr double kMoves_hz = 1.0;

void offer(StepRate& largest, double hz, std::size_t line) {
  if (hz > largest.hz) {
    largest = {hz, line};
  }
}

// Offers the rates of one line to the largest ones so far.
void offer(StepRates& largest, const std::array<double, kStepMotors>& hz, std::size_t line) {
  double total_hz = 0.0;
  int moving = 0;
  for (std::size_t i = 0; i < hz.size(); ++i) {
    offer(largest.motors[i], hz[i], line);
    total_hz += hz[i];
    moving += hz[i] > kMoves_hz ? 1 : 0;
  }
  offer(largest.total, total_hz, line);
  if (moving > 1) {
    offer(largest.shared, total_hz, line);
  }
}

bool is_above(const StepRate& rate, double limit_hz) {
  return rate.hz > (1.0 + kLimitTolerance) * limit_hz;
}

std::array<std::string_view, kStepMotors> names_of(const Motors& motors) {
  const auto& [a, b, c] = motors.names();
  return {a, b, c, "E"};
}

}  // namespace

bool StepRules::is_known() const {
  return std::ranges::any_of(steps_per_mm, [](double steps) { return steps > 0.0; });
}

StepGauge::StepGauge(const planner::FirmwareConfig& fixed, const StepRules& rules)
    : rules_(rules),
      motors_(fixed.motors),
      is_known_(rules.is_known()),
      none_{names_of(motors_), rules.steps_per_mm, {}, {}, {}},
      largest_(none_),
      certain_(none_) {}

void StepGauge::clear() { largest_ = certain_ = none_; }

void StepGauge::play(const planner::PlannedMove& move) {
  const double duration_s = move.duration_s();
  if (!is_known_ || duration_s <= 0.0) {
    return;
  }
  // A line is nowhere faster than at one of these three.
  const double v = std::max({move.start_v_mm_s, move.cruise_v_mm_s, move.end_v_mm_s});
  std::array<double, kStepMotors> hz{};
  std::array<double, kStepMotors> certain_hz{};
  for (std::size_t i = 0; i < hz.size(); ++i) {
    const double share = i == kFilament ? move.direction[gcode::E] : motors_.of(i, move.direction);
    const double uncertainty = i == kFilament ? 1.0 : motors_.uncertainty(i);
    hz[i] = rules_.steps_per_mm[i] * std::abs(share) * v;
    certain_hz[i] =
        std::max(hz[i] - rules_.steps_per_mm[i] * uncertainty * kRounding_mm / duration_s, 0.0);
  }
  offer(largest_, hz, move.segment.line);
  offer(certain_, certain_hz, move.segment.line);
}

std::vector<StepBreach> StepGauge::breaches() const {
  std::vector<StepBreach> found;
  for (std::size_t i = 0; i < certain_.motors.size(); ++i) {
    const StepRate& rate = certain_.motors[i];
    if (is_above(rate, rules_.max_hz)) {
      found.push_back({rate.line, fmt::format("motor {} makes {:.0f} steps per second, and its "
                                              "limit is {:.0f}",
                                              certain_.names[i], rate.hz, rules_.max_hz)});
    }
  }
  const auto check_sum = [&](const StepRate& rate, double limit_hz) {
    if (is_above(rate, limit_hz)) {
      found.push_back({rate.line, fmt::format("all motors together make {:.0f} steps per second, "
                                              "and their limit is {:.0f}",
                                              rate.hz, limit_hz)});
    }
  };
  check_sum(certain_.total, rules_.max_total_hz);
  if (rules_.max_shared_hz < rules_.max_total_hz) {
    check_sum(certain_.shared, rules_.max_shared_hz);
  }
  return found;
}

}  // namespace unflex::verify
