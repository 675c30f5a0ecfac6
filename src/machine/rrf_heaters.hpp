// The hotend's model in RepRapFirmware's config.g: M307, and M563, which says whose heater is
// whose.
//
// Notation of unflex/hotend/firmware_words.hpp: dT/dt = R u − K (ΔT/100)^E.
#pragma once

#include <map>
#include <string>

#include "assign.hpp"
#include "unflex/gcode/command.hpp"

namespace unflex::machine {

class RrfHeaters {
 public:
  // Any line; others than these two are left alone.
  void read(const gcode::Command& command, const SourcePlace& place);
  // Adds the model of the first tool's heater, if there is one.
  void add_to(Reading& reading) const;

 private:
  struct Model {
    double gain_c = 0.0;  // for each count of power
    double time_constant_s = 0.0;
    double dead_time_s = 0.0;
    SourcePlace place;
  };

  std::map<int, Model> models_;  // by heater
  int heater_ = 1;               // of the first tool
};

}  // namespace unflex::machine
