// G-code whose stops show what still rings once an axis is compensated.
#pragma once

#include <string>

#include "unflex/core/error.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::machine {

// The file, to be compensated: homing, then for each speed a move along the axis, 'x' or 'y', a
// second of rest, and the accelerometer's commands around both. Nothing is heated or extruded. An
// error of kind usage if the travel is too small, or if the firmware cannot record.
[[nodiscard]] Result<std::string> ring_test(const Settings& settings, char axis);

}  // namespace unflex::machine
