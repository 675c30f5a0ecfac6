// The settings while they are being read: the values, the alternative form of the dynamics, and the
// place each key was given at.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::machine {

// An axis as mass, spring and damper; complete or absent once validated.
struct MassSpringDamper {
  std::optional<double> mass_g;
  std::optional<double> stiffness_n_mm;
  std::optional<double> damping_n_s_mm;
};

// Printers whose damping was measured lie well within these.
inline constexpr double kLeastDamping = 0.01;
inline constexpr double kMostDamping = 0.5;

[[nodiscard]] inline bool is_plausible_damping(double ratio) {
  return ratio >= kLeastDamping && ratio <= kMostDamping;
}

// The section that all keys of tools begin with.
inline constexpr std::string_view kToolSection = "tool";

// A remark for the user, and the keys that it is about. If other places give all of these keys, it
// is not told. kToolSection stands for any key of a tool.
struct Note {
  Diagnostic diagnostic;
  std::vector<std::string> keys;
};

struct Draft {
  Settings settings;
  std::vector<Note> notes;
  Axes<MassSpringDamper> mass;
  // Parallel to key_table(): where the key was given last; empty while it has its default.
  std::vector<std::optional<SourcePlace>> places;
  std::map<std::string, SourcePlace> tool_places;  // where each key of a tool was given last
  std::string printer_file;  // the name it goes by in messages; empty if none is given
  // The end of a message about a missing setting, if the printer file names other files that could
  // not be read.
  std::string maybe_elsewhere;
  bool is_firmware_plain = false;  // Sources::is_firmware_plain
};

}  // namespace unflex::machine
