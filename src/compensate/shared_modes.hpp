// The modes of all models of an axis, those that are alike counted once.
//
// A mode's part of the nozzle's motion is its gain times the motion of a mode whose gain is 1.
// Models that have a mode in common therefore share its motion, unless the mode begins differently
// in them.
#pragma once

#include <cstddef>
#include <vector>

#include "unflex/compensate/axis_window.hpp"

namespace unflex::compensate {

struct SharedModes {
  struct Swing {
    dynamics::Mode mode;  // its gain is 1
    // How far and how fast it is ahead of the base at the window's start, mm and mm/s. 0 if the
    // start is not given.
    dynamics::NozzleMotion ahead;
  };
  struct Part {
    std::size_t mode = 0;
    double gain = 0.0;
  };
  struct Model {
    std::vector<Part> parts;
    double share = 0.0;  // α
  };

  std::vector<Swing> modes;
  std::vector<Model> models;
};

[[nodiscard]] SharedModes shared_modes(const AxisWindow& window);

}  // namespace unflex::compensate
