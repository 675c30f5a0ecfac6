// The kernels by the registers that they use (unflex/core/lanes.hpp).
#pragma once

#include "bundle_kernel.hpp"
#include "unflex/core/lanes.hpp"

namespace unflex::verify {

[[nodiscard]] const BundleKernel& two_lanes_bundle();
[[nodiscard]] const BundleKernel& four_lanes_bundle();

}  // namespace unflex::verify
