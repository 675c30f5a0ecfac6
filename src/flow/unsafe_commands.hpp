// Commands that no translated print may hold.
#pragma once

#include <optional>
#include <string>

#include "unflex/gcode/command.hpp"

namespace unflex::flow {

// Why the firmware of a machine whose X, Y and Z are joints must not get this command, and what to
// do. nullopt for other commands. Commands that may move the machine are not looked at here.
[[nodiscard]] std::optional<std::string> why_unsafe(const gcode::Command& command);

// The command as messages call it: "G29", "BED_MESH_PROFILE".
[[nodiscard]] std::string name_of(const gcode::Command& command);

// Whether it sets limits of X, Y or Z, which are joints here: M201, M203, M205, M208, M566.
[[nodiscard]] bool limits_joints(const gcode::Command& command);

}  // namespace unflex::flow
