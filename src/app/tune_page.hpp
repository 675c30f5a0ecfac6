// The page on a tower: how to read it, the value of each band, and the look of its walls.
#pragma once

#include <string>
#include <vector>

#include "unflex/tune/bands.hpp"

namespace unflex::app {

// reliefs: the reliefs of the tower's walls, by band, on a printer whose axes are `axes`.
[[nodiscard]] std::string tune_page(const tune::TowerSettings& settings, const tune::Tower& tower,
                                    const std::vector<std::vector<tune::Relief>>& reliefs,
                                    const tune::TrueAxes& axes);

// The page on a tower for the pressure. widths: the widths of its bands' outer rings with this
// hotend.
[[nodiscard]] std::string pressure_page(const tune::PressureTowerSettings& settings,
                                        const tune::Tower& tower,
                                        const std::vector<tune::RingWidths>& widths,
                                        const tune::TrueHotend& hotend);

}  // namespace unflex::app
