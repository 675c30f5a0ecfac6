// A record as Klipper's calibration looks at it.
#pragma once

#include <vector>

#include "unflex/identify/record.hpp"

namespace unflex::app {

// The densities of a record, the k-th at k · step_hz: of the column with the most motion, and the
// sum of all three.
struct Densities {
  double step_hz = 0.0;
  std::vector<double> column;
  std::vector<double> sum;
};

[[nodiscard]] Densities densities_of(const identify::DataSet& set);

}  // namespace unflex::app
