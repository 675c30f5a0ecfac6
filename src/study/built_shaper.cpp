#include "built_shaper.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace unflex::study {

Result<BuiltShaper> built_shaper(const dynamics::Shaper& shaper,
                                 const dynamics::FlexibleAxis& axis) {
  const double damping_ratio = axis.main_damping_ratio();
  if (damping_ratio >= 1.0) {
    return fail(ErrorKind::input, "undefined at ζ = 1: without vibration there is no period");
  }
  const double most = dynamics::max_damping_ratio(shaper.kind);
  const double zeta = std::min(damping_ratio, most);
  BuiltShaper built{*dynamics::shaper_pulses(shaper, axis.main_hz(), zeta), {}};
  if (zeta < damping_ratio) {
    built.remark = fmt::format("built for ζ = {}, the most it is defined for", most);
  }
  return built;
}

}  // namespace unflex::study
