#include "unflex/verify/machine_change.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::verify {
namespace {

double share_at(const ShareMap& map, double place_mm) {
  double share = map.share.front();
  for (std::size_t i = 1; i < map.at_mm.size(); ++i) {
    const double span_mm = map.at_mm[i] - map.at_mm[i - 1];
    const double part = std::clamp((place_mm - map.at_mm[i - 1]) / span_mm, 0.0, 1.0);
    share += part * (map.share[i] - map.share[i - 1]);
  }
  return share;
}

}  // namespace

bool MachineChange::acts() const {
  return any_axis(
      [](const AxisChange& axis) { return axis.moving_mass_g > 0.0 || !axis.maps.empty(); }, axes);
}

bool MachineChange::acts_over_bed() const {
  return any_axis(
      [](const AxisChange& axis) {
        return std::ranges::any_of(axis.maps,
                                   [](const ShareMap& map) { return map.along != gcode::Z; });
      },
      axes);
}

Axes<double> MachineChange::frequency_shares(const gcode::Position& at) const {
  const double printed_g = std::max(at[gcode::E], 0.0) * filament_g_per_mm;
  const auto share_of = [&](const AxisChange& axis) {
    const double mass_g = axis.moving_mass_g;
    double share = mass_g > 0.0 ? std::sqrt(mass_g / (mass_g + printed_g)) : 1.0;
    for (const ShareMap& map : axis.maps) {
      share *= share_at(map, at[map.along]);
    }
    return share;
  };
  return map_axes(share_of, axes);
}

}  // namespace unflex::verify
