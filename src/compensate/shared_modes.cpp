#include "shared_modes.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace unflex::compensate {
namespace {

// Starts that differ by no more than this are the same, mm.
constexpr double kSame_mm = 1e-9;

bool are_alike(const SharedModes::Swing& a, const SharedModes::Swing& b) {
  const double omega = a.mode.omega_rad_s;
  return omega == b.mode.omega_rad_s && a.mode.zeta == b.mode.zeta &&
         std::abs(a.ahead.position - b.ahead.position) <= kSame_mm &&
         std::abs(a.ahead.velocity - b.ahead.velocity) <= kSame_mm * omega;
}

}  // namespace

SharedModes shared_modes(const AxisWindow& window) {
  SharedModes shared;
  for (std::size_t c = 0; c < window.models(); ++c) {
    const Plant plant = window.model(c);
    const std::span<const dynamics::Mode> modes = plant.axis.modes();
    dynamics::NozzleState start;
    if (window.start) {
      start = window.in_model(c, window.start->nozzle, window.start->base_mm);
    }
    SharedModes::Model model{{}, plant.share};
    for (std::size_t i = 0; i < modes.size(); ++i) {
      const double gain = modes[i].gain;
      SharedModes::Swing swing{modes[i], {}};
      swing.mode.gain = 1.0;
      if (window.start && gain != 0.0) {
        swing.ahead = {start.parts[i].position / gain - window.start->base_mm,
                       start.parts[i].velocity / gain};
      }
      const auto known = std::ranges::find_if(
          shared.modes, [&](const SharedModes::Swing& other) { return are_alike(swing, other); });
      model.parts.push_back({static_cast<std::size_t>(known - shared.modes.begin()), gain});
      if (known == shared.modes.end()) {
        shared.modes.push_back(swing);
      }
    }
    shared.models.push_back(std::move(model));
  }
  return shared;
}

}  // namespace unflex::compensate
