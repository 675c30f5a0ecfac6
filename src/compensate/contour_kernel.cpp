#include "contour_kernel.hpp"

#include "lane_kernels.hpp"

namespace unflex::compensate {

std::unique_ptr<ContourKernel> make_contour_kernel(std::size_t pairs) {
  return has_four_lanes() ? make_four_lanes_contour(pairs) : make_two_lanes_contour(pairs);
}

}  // namespace unflex::compensate
