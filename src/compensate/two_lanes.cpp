#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "lane_kernels.hpp"
// These include nothing themselves, so they come last.
#include "contour_lanes.hpp"
#include "stage_lanes.hpp"
// These define members of stage_lanes.hpp.
#include "stage_factor_lanes.hpp"
#include "stage_sweep_lanes.hpp"

namespace unflex::compensate {

std::unique_ptr<StageKernel> make_two_lanes_stages(std::size_t modes, std::size_t models) {
  return fitting_stages<TwoLanes>(modes, models);
}

std::unique_ptr<ContourKernel> make_two_lanes_contour(std::size_t pairs) {
  return fitting_contour<TwoLanes>(pairs);
}

}  // namespace unflex::compensate
