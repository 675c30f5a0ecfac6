#include "unflex/machine/kinematic_machine.hpp"

#include <numbers>

namespace unflex::machine {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180.0;

kinematics::Tripteron tripteron(const KinematicsSettings& settings, kinematics::Linear linear) {
  kinematics::Tripteron result{.linear = linear, .legs = {}, .bars = {}};
  for (std::size_t i = 0; i < result.legs.size(); ++i) {
    result.legs[i] = {.rail_y_mm = (*settings.rail_y_mm)[i],
                      .rail_z_mm = (*settings.rail_z_mm)[i],
                      .tool_joint_mm = *settings.tool_joint_mm[i]};
  }
  result.bars.upper_mm = settings.bars_mm->front();
  result.bars.lower_mm = settings.bars_mm->back();
  if (settings.elbow_deg) {
    result.bars.least_elbow_rad = kDegree_rad * settings.elbow_deg->min;
    result.bars.most_elbow_rad = kDegree_rad * settings.elbow_deg->max;
  }
  if (!settings.offset_mm) {
    result.linear.offset_mm = kinematics::offset_of_legs(linear.motors.rows(), result.legs);
  }
  return result;
}

}  // namespace

kinematics::Machine kinematic_machine(const Settings& settings) {
  const KinematicsSettings& told = settings.kinematics;
  const kinematics::Linear linear{.motors = settings.motors(),
                                  .offset_mm = told.offset_mm.value_or(Motors::Row{})};
  kinematics::Machine machine{.mechanism = linear, .ranges_mm = {}};
  // Validation has seen to it that the other keys of the legs are there, too.
  if (told.bars_mm) {
    machine.mechanism = tripteron(told, linear);
  }
  for (std::size_t i = 0; i < machine.ranges_mm.size(); ++i) {
    if (told.range_mm[i]) {
      machine.ranges_mm[i] = {told.range_mm[i]->min, told.range_mm[i]->max};
    }
  }
  return machine;
}

}  // namespace unflex::machine
