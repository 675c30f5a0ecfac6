#include <cstddef>

#include "bundle_kernels.hpp"
// Included after everything that it needs.
#include "bundle_lanes.hpp"

namespace unflex::verify {

const BundleKernel& two_lanes_bundle() {
  static const LaneBundle<TwoLanes> kernel;
  return kernel;
}

}  // namespace unflex::verify
