// The kernels by the registers that they use (unflex/core/lanes.hpp).
#pragma once

#include "contour_kernel.hpp"
#include "stage_kernel.hpp"

namespace unflex::compensate {

[[nodiscard]] std::unique_ptr<StageKernel> make_two_lanes_stages(std::size_t modes,
                                                                 std::size_t models);
[[nodiscard]] std::unique_ptr<ContourKernel> make_two_lanes_contour(std::size_t pairs);

[[nodiscard]] std::unique_ptr<StageKernel> make_four_lanes_stages(std::size_t modes,
                                                                  std::size_t models);
[[nodiscard]] std::unique_ptr<ContourKernel> make_four_lanes_contour(std::size_t pairs);

}  // namespace unflex::compensate
