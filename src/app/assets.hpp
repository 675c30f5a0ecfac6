// The files of assets/, which the build turns into constants (cmake/EmbedText.cmake).
#pragma once

#include <string_view>

namespace unflex::app::assets {

// Sources: Klipper klippy/extras/gcode_macro.py (macros, variables, rename_existing),
// pause_resume.py (what PAUSE does, also for the web interface), virtual_sdcard.py (is_active,
// do_pause), filament_switch_sensor.py (what a runout does).
extern const std::string_view klipper_macros_cfg;
// Copies what stands in #lines when #copy is pressed.
extern const std::string_view copy_js;

}  // namespace unflex::app::assets
