// The page on a tower: how to read it, what each band stands for, and what its walls would look
// like.
#pragma once

#include <string>
#include <vector>

#include "unflex/pipeline/tune.hpp"

namespace unflex::app {

// reliefs: those of the tower's walls, by band, on a printer whose axes are `axes`.
[[nodiscard]] std::string tune_page(const tune::TowerSettings& settings, const tune::Tower& tower,
                                    const std::vector<std::vector<pipeline::Relief>>& reliefs,
                                    const pipeline::TrueAxes& axes);

}  // namespace unflex::app
