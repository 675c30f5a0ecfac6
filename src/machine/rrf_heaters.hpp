// The hotend's model in RepRapFirmware's config.g: M307 describes a heater, and M563 says which
// heater a tool has. Notation as in unflex/hotend/firmware_words.hpp:
//   dT/dt = R u − K (ΔT/100)^E
#pragma once

#include <map>
#include <string>

#include "assign.hpp"
#include "unflex/gcode/command.hpp"

namespace unflex::machine {

class RrfHeaters {
 public:
  // Takes any line in turn, and heeds M307 and M563.
  void read(const gcode::Command& command, const SourcePlace& place);
  // Adds the model of tool 0's heater, if there is one.
  void add_to(Reading& reading) const;

 private:
  struct Model {
    double gain_c = 0.0;  // for each count of power
    double time_constant_s = 0.0;
    double dead_time_s = 0.0;
    SourcePlace place;
  };

  std::map<int, Model> models_;  // by heater
  int heater_ = 1;               // of tool 0; 1 is usual
};

}  // namespace unflex::machine
