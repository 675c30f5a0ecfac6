#include <cstddef>

#include "bundle_kernels.hpp"

UNFLEX_FOUR_LANES_BEGIN
// Included after everything that it needs.
#include "bundle_lanes.hpp"

namespace unflex::verify {

const BundleKernel& four_lanes_bundle() {
  static const LaneBundle<FourLanes> kernel;
  return kernel;
}

}  // namespace unflex::verify
UNFLEX_FOUR_LANES_END
