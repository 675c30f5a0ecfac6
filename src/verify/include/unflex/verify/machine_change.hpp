// What changes the frequencies of the axes while a print goes on.
//
//   f = f₀ √(m₀ / (m₀ + m)) Π s      m₀, m  mass of a bed that moves along the axis, and of what
//                                           lies on it      s  shares by the nozzle's place
#pragma once

#include <cstddef>
#include <vector>

#include "unflex/core/axes.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::verify {

// f / f₀ at some places along X, Y or Z: linear between two places, constant beyond them.
struct ShareMap {
  std::size_t along = gcode::Z;
  std::vector<double> at_mm;  // increasing, at least one
  std::vector<double> share;
};

struct AxisChange {
  double moving_mass_g = 0.0;  // m₀; 0: the axis does not carry the print
  std::vector<ShareMap> maps;
};

struct MachineChange {
  Axes<AxisChange> axes;
  double filament_g_per_mm = 0.0;  // of the print that lies on the bed

  [[nodiscard]] bool acts() const;
  // Whether frequencies change while the nozzle moves in X or Y.
  [[nodiscard]] bool acts_over_bed() const;
  // f / f₀ of each axis where the machine is, and all filament so far has been laid.
  [[nodiscard]] Axes<double> frequency_shares(const gcode::Position& at) const;
};

}  // namespace unflex::verify
