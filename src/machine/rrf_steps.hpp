// Steps per mm in RepRapFirmware's config.g: M92 and M350.
#pragma once

#include <array>

#include "assign.hpp"
#include "unflex/gcode/command.hpp"

namespace unflex::machine {

// RepRapFirmware 3.5: GCodes.cpp, ChangeMicrostepping; Platform.cpp, SetDriveStepsPerUnit. Steps
// per mm are of the microsteps in force. M350 rescales them, and M92 S says for which microsteps
// its values are.
class RrfSteps {
 public:
  RrfSteps();

  // Takes an M92.
  void set(const gcode::Command& command, const SourcePlace& place, Reading& reading);
  // Takes an M350.
  void set_microsteps(const gcode::Command& command, const SourcePlace& place, Reading& reading);

 private:
  std::array<double, 4> steps_per_mm_{};
  std::array<double, 4> microsteps_{};
};

}  // namespace unflex::machine
