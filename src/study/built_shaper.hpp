// The shaper of an axis.
#pragma once

#include <string>

#include "unflex/core/error.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/shapers.hpp"

namespace unflex::study {

// Built for the axis's main mode, or for the largest damping that the shaper is defined for.
struct BuiltShaper {
  dynamics::ShaperPulses pulses;
  std::string remark;
};

// An error of kind input where there is no vibration to shape.
[[nodiscard]] Result<BuiltShaper> built_shaper(const dynamics::Shaper& shaper,
                                               const dynamics::FlexibleAxis& axis);

}  // namespace unflex::study
