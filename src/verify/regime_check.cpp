#include "regime_check.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <string_view>

namespace unflex::verify {
namespace {

// Rounding steps of emitted coordinates (four decimals) and filament (five, and the remainder).
constexpr double kPositionTolerance_mm = 1e-4 + 1e-9;
constexpr double kFilamentTolerance_mm = 2e-5;
constexpr double kRelativeTolerance = 1e-6;

class Differences {
 public:
  void compare(std::string_view what, double input, double output, double tolerance) {
    if (!(std::abs(input - output) <= tolerance)) {
      add(fmt::format("{} is {:.6g} instead of {:.6g}", what, output, input));
    }
  }
  void compare_relative(std::string_view what, double input, double output) {
    compare(what, input, output, kRelativeTolerance * std::abs(input));
  }
  void compare(bool equal, std::string_view what) {
    if (!equal) {
      add(fmt::format("{} differs", what));
    }
  }
  [[nodiscard]] std::string text() const { return text_; }

 private:
  void add(std::string_view difference) {
    text_ += text_.empty() ? "" : ", ";
    text_ += difference;
  }
  std::string text_;
};

}  // namespace

std::string modal_difference(const gcode::ModalState& input, const gcode::ModalState& output) {
  Differences differences;
  constexpr std::array<std::string_view, 3> kNames = {"X", "Y", "Z"};
  for (const std::size_t axis : {gcode::X, gcode::Y, gcode::Z}) {
    differences.compare(kNames[axis], input.position_mm[axis], output.position_mm[axis],
                        kPositionTolerance_mm);
    differences.compare(fmt::format("{} origin", kNames[axis]), input.base_mm[axis],
                        output.base_mm[axis], kPositionTolerance_mm);
    differences.compare(input.known[axis] == output.known[axis],
                        fmt::format("whether {} is known", kNames[axis]));
  }
  if (input.e_is_absolute()) {
    differences.compare("E", input.position_mm[gcode::E] - input.base_mm[gcode::E],
                        output.position_mm[gcode::E] - output.base_mm[gcode::E],
                        kFilamentTolerance_mm);
  }
  differences.compare(input.absolute_xyz == output.absolute_xyz, "G90/G91");
  differences.compare(input.e_is_absolute() == output.e_is_absolute(), "M82/M83");
  differences.compare(input.plane == output.plane, "plane (G17 to G19)");
  differences.compare(input.retracted == output.retracted, "firmware retraction");
  differences.compare_relative("unit", input.unit_mm, output.unit_mm);
  differences.compare_relative("feed rate", input.feed_mm_s, output.feed_mm_s);
  differences.compare_relative("speed factor", input.speed_factor, output.speed_factor);
  differences.compare_relative("flow factor", input.filament_factor(), output.filament_factor());
  return differences.text();
}

std::string limits_difference(const planner::Limits& input, const planner::Limits& output) {
  Differences differences;
  differences.compare_relative("maximum velocity", input.max_velocity_mm_s,
                               output.max_velocity_mm_s);
  differences.compare_relative("maximum acceleration", input.max_accel_mm_s2,
                               output.max_accel_mm_s2);
  differences.compare_relative("square corner velocity", input.square_corner_velocity_mm_s,
                               output.square_corner_velocity_mm_s);
  differences.compare_relative("minimum cruise ratio", input.minimum_cruise_ratio,
                               output.minimum_cruise_ratio);
  differences.compare_relative("acceleration to deceleration", input.accel_to_decel_mm_s2,
                               output.accel_to_decel_mm_s2);
  constexpr std::array<std::string_view, 4> kAxes = {"X", "Y", "Z", "E"};
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    differences.compare_relative(fmt::format("maximum velocity of {}", kAxes[axis]),
                                 input.axis_max_velocity_mm_s[axis],
                                 output.axis_max_velocity_mm_s[axis]);
    differences.compare_relative(fmt::format("maximum acceleration of {}", kAxes[axis]),
                                 input.axis_max_accel_mm_s2[axis],
                                 output.axis_max_accel_mm_s2[axis]);
    differences.compare_relative(fmt::format("jerk of {}", kAxes[axis]), input.axis_jerk_mm_s[axis],
                                 output.axis_jerk_mm_s[axis]);
    if (input.axis_max_jerk_mm_s[axis] != output.axis_max_jerk_mm_s[axis]) {
      differences.compare_relative(fmt::format("most jerk of {}", kAxes[axis]),
                                   input.axis_max_jerk_mm_s[axis], output.axis_max_jerk_mm_s[axis]);
    }
  }
  differences.compare_relative("acceleration of prints", input.print_accel_mm_s2,
                               output.print_accel_mm_s2);
  differences.compare_relative("acceleration of travel", input.travel_accel_mm_s2,
                               output.travel_accel_mm_s2);
  differences.compare_relative("acceleration of retraction", input.retract_accel_mm_s2,
                               output.retract_accel_mm_s2);
  differences.compare_relative("junction deviation", input.junction_deviation_mm,
                               output.junction_deviation_mm);
  differences.compare_relative("minimum velocity", input.min_velocity_mm_s,
                               output.min_velocity_mm_s);
  differences.compare_relative("minimum velocity of travel", input.min_travel_velocity_mm_s,
                               output.min_travel_velocity_mm_s);
  differences.compare_relative("minimum segment time", input.min_segment_time_s,
                               output.min_segment_time_s);
  differences.compare_relative("minimum speed of movement", input.min_movement_velocity_mm_s,
                               output.min_movement_velocity_mm_s);
  differences.compare(input.jerk_policy == output.jerk_policy, "jerk policy");
  return differences.text();
}

}  // namespace unflex::verify
