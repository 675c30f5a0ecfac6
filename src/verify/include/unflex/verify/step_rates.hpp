// How many steps per second a file asks of each motor.
//
//   f_i = s_i |J_i · v|     f  rate of motor i      s  its steps per mm
//                           v  velocity of the axes at the cruise of a line, where it is largest
//                           J_i  row of motor i: travel of the motor per travel of the axes
#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/kinematics.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::verify {

// The motors of X, Y and Z, in the order of `Motors`, and then the extruder's motor.
inline constexpr std::size_t kStepMotors = Motors::kCount + 1;

// The motors' steps per mm, and how many per second are allowed.
struct StepRules {
  std::array<double, kStepMotors> steps_per_mm{};  // 0: not known, the motor is not counted
  double max_hz = std::numeric_limits<double>::infinity();        // of each motor
  double max_total_hz = std::numeric_limits<double>::infinity();  // of all motors together
  // A limit like max_total_hz that holds only while more than one motor moves.
  double max_shared_hz = std::numeric_limits<double>::infinity();

  [[nodiscard]] bool is_known() const;
};

// A rate and the line that has it; 0: no line.
struct StepRate {
  double hz = 0.0;
  std::size_t line = 0;
};

// The largest rates of a file or a part of it.
struct StepRates {
  std::array<std::string_view, kStepMotors> names{};
  std::array<double, kStepMotors> steps_per_mm{};  // 0: not known, and no rate is
  std::array<StepRate, kStepMotors> motors{};
  StepRate total;   // of all motors together
  StepRate shared;  // the same, only while more than one motor moves
};

// A limit that the rates exceed.
struct StepBreach {
  std::size_t line = 0;
  std::string message;
};

// Measures the rates of planned moves. Pressure advance is not counted.
class StepGauge {
 public:
  StepGauge(const planner::FirmwareConfig& fixed, const StepRules& rules);

  void play(const planner::PlannedMove& move);
  // Forgets all moves so far.
  void clear();

  [[nodiscard]] const StepRates& largest() const { return largest_; }
  // The limits that are broken by more than the rounding of coordinates explains, each with the
  // line that breaks it most.
  [[nodiscard]] std::vector<StepBreach> breaches() const;

 private:
  StepRules rules_;
  Motors motors_;
  bool is_known_;
  StepRates none_;  // before the first move
  StepRates largest_;
  StepRates certain_;  // without what rounding may have added
};

}  // namespace unflex::verify
