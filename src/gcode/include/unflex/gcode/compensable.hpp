// Which motion may be rewritten.
#pragma once

#include <string_view>

#include "unflex/core/firmware.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {

// Largest |ΔZ| per mm of travel in X and Y at which a motion still counts as drawn in the plane. A
// spiral vase climbs one layer per turn, which is far less. A Z hop climbs far more.
inline constexpr double kMaxSlope = 0.02;

// Whether unflex may replace this motion: it starts at a known place, moves in X or Y and hardly in
// Z. Klipper limits a move that pulls filament back by its extruder's own acceleration, which no
// G-code raises (kinematics/extruder.py, check_move). So with Klipper such a move stays as it is.
[[nodiscard]] bool compensable(const Segment& segment, Firmware firmware);

// Whether unflex may replace a whole line: it is a move, and all its segments are compensable. A
// line is rewritten as a whole or not at all.
[[nodiscard]] bool compensable(const Event& event, Firmware firmware);

// Whether a line is a move by its words (G0 to G3 with an axis or E), even if it changes nothing
// where it stands. Between two lines of a rewritten motion the machine is elsewhere, and there the
// line would move it.
[[nodiscard]] bool names_position(std::string_view content);

// Why a motion that is not compensable stays as it is: "start unknown", "too much filament",
// "extrude only", "retracting move" or "Z move". Empty for a compensable one.
[[nodiscard]] std::string_view kept_reason(const Segment& segment, Firmware firmware);

}  // namespace unflex::gcode
