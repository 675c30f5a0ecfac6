#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "lane_kernels.hpp"
// After all that they need.
#include "contour_lanes.hpp"
#include "stage_lanes.hpp"
// And after that.
#include "stage_factor_lanes.hpp"

namespace unflex::compensate {

std::unique_ptr<StageKernel> make_two_lanes_stages(std::size_t modes, std::size_t models) {
  return fitting_stages<TwoLanes>(modes, models);
}

std::unique_ptr<ContourKernel> make_two_lanes_contour(std::size_t pairs) {
  return fitting_contour<TwoLanes>(pairs);
}

}  // namespace unflex::compensate
