#include "contour_kernel.hpp"

#include "lane_kernels.hpp"

namespace unflex::compensate {

std::unique_ptr<ContourKernel> make_contour_kernel(std::size_t pairs) {
#ifdef UNFLEX_FOUR_LANES
  if (has_four_lanes()) {
    return make_four_lanes_contour(pairs);
  }
#endif
  return make_two_lanes_contour(pairs);
}

}  // namespace unflex::compensate
