#include "unflex/dynamics/frequency_field.hpp"

#include <algorithm>
#include <cstddef>

namespace unflex::dynamics {

double SharesAlong::at(double place_mm) const {
  if (at_mm.empty()) {
    return 1.0;
  }
  const auto above = std::ranges::upper_bound(at_mm, place_mm);
  const auto next = static_cast<std::size_t>(above - at_mm.begin());
  if (next == 0 || next == at_mm.size()) {
    return next == 0 ? share.front() : share.back();
  }
  const double part = (place_mm - at_mm[next - 1]) / (at_mm[next] - at_mm[next - 1]);
  return std::lerp(share[next - 1], share[next], part);
}

}  // namespace unflex::dynamics
