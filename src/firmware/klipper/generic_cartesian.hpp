// The motors of Klipper's generic_cartesian, whose steppers move any sum of carriages.
#pragma once

#include <string>
#include <vector>

#include "klipper_config.hpp"
#include "unflex/core/error.hpp"
#include "unflex/core/kinematics.hpp"

namespace unflex::machine {

struct GenericMotor {
  std::string section;  // "stepper a"
  SourcePlace place;    // of what it moves
  Motors::Row row;      // its travel per mm of X, Y and Z
};

// The motors of a configuration, by their sections' names. Steppers that do the same count once.
// maybe_elsewhere: where what is missing may be, to end a message with. Errors, of kind usage: a
// stepper whose sum of carriages Klipper would refuse as well.
[[nodiscard]] Result<std::vector<GenericMotor>> generic_motors(const KlipperConfig& config,
                                                               const std::string& maybe_elsewhere);

// The axis of a [carriage …], 0 to 2 for X to Z: what it says, or else its name. -1: neither.
[[nodiscard]] int axis_of_carriage(const std::string& section_name, const KlipperSection& section);

// The kinematics with these motors: cartesian where each moves one carriage as far as the carriage,
// corexy, or else linear.
[[nodiscard]] Kinematics kinematics_of(const std::vector<GenericMotor>& motors);

}  // namespace unflex::machine
