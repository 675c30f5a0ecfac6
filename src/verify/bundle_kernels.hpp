// The kernels by the registers that they use (unflex/core/lanes.hpp).
#pragma once

#include "bundle_kernel.hpp"
#include "unflex/core/lanes.hpp"

namespace unflex::verify {

[[nodiscard]] const BundleKernel& two_lanes_bundle();
#ifdef UNFLEX_FOUR_LANES
[[nodiscard]] const BundleKernel& four_lanes_bundle();
#endif

}  // namespace unflex::verify
