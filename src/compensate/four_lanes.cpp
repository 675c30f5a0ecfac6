#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "lane_kernels.hpp"

UNFLEX_FOUR_LANES_BEGIN
// After all that they need.
#include "contour_lanes.hpp"
#include "stage_lanes.hpp"
// And after that.
#include "stage_factor_lanes.hpp"

namespace unflex::compensate {

std::unique_ptr<StageKernel> make_four_lanes_stages(std::size_t modes, std::size_t models) {
  return fitting_stages<FourLanes>(modes, models);
}

std::unique_ptr<ContourKernel> make_four_lanes_contour(std::size_t pairs) {
  return fitting_contour<FourLanes>(pairs);
}

}  // namespace unflex::compensate
UNFLEX_FOUR_LANES_END
