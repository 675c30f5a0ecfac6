#include "klipper_macros.hpp"

#include <fmt/core.h>

#include "assets.hpp"
#include "unflex/app/run_config.hpp"

namespace unflex::app {

std::string klipper_macros() {
  return fmt::format("# Written by unflex {}: see docs/pausing.md.\n", version())
      .append(assets::klipper_macros_cfg);
}

}  // namespace unflex::app
