#include <fmt/core.h>

#include "command_reader.hpp"
#include "rrf_steps.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::machine {
namespace {

std::string key_of(std::size_t axis) { return fmt::format("printer.{}_steps_per_mm", kAxes[axis]); }

}  // namespace

RrfSteps::RrfSteps() {
  constexpr double kDefaultMicrosteps = 16.0;  // Platform.cpp, Init
  Settings defaults;
  defaults.printer.firmware = Firmware::rrf;
  steps_per_mm_ = defaults.steps_per_mm();
  microsteps_.fill(kDefaultMicrosteps);
}

void RrfSteps::set(const gcode::Command& command, const SourcePlace& place, Reading& reading) {
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    const std::optional<double> value = command.value(letter_of(axis));
    if (!value) {
      continue;
    }
    const double of_microsteps = command.value('S').value_or(0.0);
    steps_per_mm_[axis] = of_microsteps > 0.0 ? *value * microsteps_[axis] / of_microsteps : *value;
    reading.add(key_of(axis), steps_per_mm_[axis], place);
  }
}

void RrfSteps::set_microsteps(const gcode::Command& command, const SourcePlace& place,
                              Reading& reading) {
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    if (!command.has(letter_of(axis))) {
      continue;
    }
    const double microsteps = command.value(letter_of(axis)).value_or(0.0);
    if (microsteps < 1.0) {
      reading.note(place,
                   fmt::format("no number of microsteps behind {}, and M350 changes steps per mm; "
                               "give {} with --set",
                               letter_of(axis), key_of(axis)),
                   {key_of(axis)});
      continue;
    }
    if (microsteps != microsteps_[axis]) {
      steps_per_mm_[axis] *= microsteps / microsteps_[axis];
      microsteps_[axis] = microsteps;
      reading.add(key_of(axis), steps_per_mm_[axis], place);
    }
  }
}

}  // namespace unflex::machine
