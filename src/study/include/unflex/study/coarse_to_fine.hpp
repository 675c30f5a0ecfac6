// Measures the thesis' proposal to start fine time steps from coarse solutions. The corner is
// solved with ever shorter node periods, each solve starting from the motion found with the period
// before.
#pragma once

#include <array>
#include <vector>

#include "unflex/compensate/axis_window.hpp"
#include "unflex/core/error.hpp"
#include "unflex/study/bench.hpp"

namespace unflex::study {

inline constexpr std::array<double, 4> kChainPeriods_s = {8e-3, 4e-3, 2e-3, 1e-3};

// Solving both axes with one node period.
struct ChainStep {
  double period_s = 0.0;
  std::size_t nodes = 0;  // nodes of one axis
  int cold_iterations = 0;
  int warm_iterations = 0;
  double cold_s = 0.0;  // wall time, the least of several
  double warm_s = 0.0;
  double contour_max_mm = 0.0;  // contour error of the cold solution
  double difference_mm = 0.0;   // difference of the base between the cold and the warm solution
};

// Solves the unflex base of the run at `multiple` times the plan's acceleration.
[[nodiscard]] Result<std::vector<ChainStep>> coarse_to_fine(const Run& run, const BenchSetup& setup,
                                                            double multiple,
                                                            const compensate::Engine& engine);

}  // namespace unflex::study
