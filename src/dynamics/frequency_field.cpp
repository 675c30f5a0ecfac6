#include "unflex/dynamics/frequency_field.hpp"

#include <algorithm>
#include <cstddef>

namespace unflex::dynamics {

double between_places(std::span<const double> at_mm, std::span<const double> values,
                      double place_mm) {
  const auto above = std::ranges::upper_bound(at_mm, place_mm);
  const auto next = static_cast<std::size_t>(above - at_mm.begin());
  if (next == 0 || next == at_mm.size()) {
    return next == 0 ? values.front() : values.back();
  }
  const double part = (place_mm - at_mm[next - 1]) / (at_mm[next] - at_mm[next - 1]);
  return std::lerp(values[next - 1], values[next], part);
}

double SharesAlong::at(double place_mm) const {
  return at_mm.empty() ? 1.0 : between_places(at_mm, share, place_mm);
}

}  // namespace unflex::dynamics
