// Turns masses on drives into what each axis shows of their modes.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "conflict.hpp"
#include "key_values.hpp"
#include "unflex/machine/mode_frame.hpp"
#include "validate.hpp"

namespace unflex::machine {
namespace {

constexpr std::array<char, 3> kDrives = {'a', 'b', 'c'};
// Less of a mode than this share does not show on an axis.
constexpr double kLeastGain = 1e-3;
// Modes closer together than this share count as one.
constexpr double kSameFrequency = 1e-6;

// Whether the key is given another value than it has by default.
bool is_given(const Draft& draft, const Key& key) {
  Draft now = draft;
  Draft plain;
  return place_of(draft, key.name) && own_value(key, now) != own_value(key, plain);
}

bool is_of_masses(std::string_view key) {
  return key.starts_with("dynamics.") && key != "dynamics.of" && !key.ends_with("_error") &&
         !is_of_axes(key);
}

Status check_forms(const Draft& draft) {
  const bool has_masses = draft.settings.swing.has_masses();
  for (const Key& key : key_table()) {
    const std::string name(key.name);
    const bool is_odd = has_masses ? is_of_axes(name) && place_of(draft, name).has_value()
                                   : is_of_masses(name) && is_given(draft, key);
    if (is_odd) {
      return conflict(
          draft, {name, "dynamics.of"},
          fmt::format("{} is given, but dynamics.of is \"{}\"; remove {} or set dynamics.of to "
                      "\"{}\"",
                      name, draft.settings.swing.of, name, has_masses ? kOfAxes : kOfMasses));
    }
  }
  return {};
}

Status check_drives(const Draft& draft) {
  const Settings& s = draft.settings;
  if (!s.swing.tool_mass_g) {
    return conflict(draft, {"dynamics.of"},
                    "dynamics.of is \"masses\", so dynamics.tool_mass_g must be given");
  }
  for (const std::string_view key :
       {"timing.tolerance_um", "second.x_freq_hz", "second.y_freq_hz"}) {
    const double value = key == "timing.tolerance_um" ? s.timing.tolerance_um
                         : key == "second.x_freq_hz"  ? s.second.freq_hz.x
                                                      : s.second.freq_hz.y;
    if (value > 0.0) {
      return conflict(draft, {key, "dynamics.of"},
                      fmt::format("{} does not go with masses on drives yet; set it to 0, or "
                                  "dynamics.of to \"axes\"",
                                  key));
    }
  }
  if (!s.tools.empty()) {
    return conflict(draft, {"dynamics.of"},
                    "dynamics.of is \"masses\", which does not go with tools of their own yet; "
                    "remove the sections [tool.*]");
  }
  const Motors motors = s.motors();
  for (std::size_t i = 0; i < kDrives.size(); ++i) {
    const std::string key = fmt::format("dynamics.{}.stiffness_n_mm", kDrives[i]);
    if (motors.moves_xy(i) && !s.swing.drives[i].stiffness_n_mm) {
      return conflict(draft, {"dynamics.of"},
                      fmt::format("dynamics.of is \"masses\", and the motor {} moves X or Y, so {} "
                                  "must be given",
                                  motors.names()[i], key));
    }
  }
  return {};
}

// The modes as an axis shows them: how much of each is along it.
std::vector<ModeSettings> modes_of(const dynamics::ModeFrame& frame, std::size_t axis) {
  std::vector<ModeSettings> modes;
  double sum = 0.0;
  for (std::size_t i = 0; i < dynamics::ModeFrame::kCount; ++i) {
    const double gain = frame.gain(axis, i);
    if (!frame.mode(i) || std::abs(gain) < kLeastGain) {
      continue;
    }
    const double hz = frame.mode(i)->omega_rad_s / (2.0 * std::numbers::pi);
    const auto alike = std::ranges::find_if(modes, [&](const ModeSettings& mode) {
      return std::abs(mode.freq_hz - hz) <= kSameFrequency * hz;
    });
    if (alike != modes.end()) {
      alike->gain += gain;
    } else {
      modes.push_back({hz, frame.mode(i)->zeta, gain});
    }
    sum += gain;
  }
  for (ModeSettings& mode : modes) {
    mode.gain /= sum;
  }
  return modes;
}

Status take_modes(std::vector<ModeSettings> modes, char axis, AxisDynamics& dynamics,
                  Draft& draft) {
  const std::string section = fmt::format("dynamics.{}", axis);
  const std::size_t frequency = *find_key(section + ".freq_hz");
  for (const ModeSettings& mode : modes) {
    if (!key_table()[frequency].bounds.contains(mode.freq_hz)) {
      return conflict(draft, {"dynamics.tool_mass_g"},
                      fmt::format("masses and stiffnesses give a mode of {:.4g} Hz along {}, which "
                                  "is out of range; check their units",
                                  mode.freq_hz, axis));
    }
  }
  const ModeSettings& main = *std::ranges::max_element(modes, {}, &ModeSettings::gain);
  dynamics.freq_hz = main.freq_hz;
  dynamics.damping_ratio = main.damping_ratio;
  for (const std::string_view key : {".freq_hz", ".damping_ratio"}) {
    draft.places[*find_key(section + std::string(key))] = place_of(draft, "dynamics.tool_mass_g");
  }
  if (modes.size() > 1) {
    dynamics.modes = std::move(modes);
  }
  return {};
}

}  // namespace

bool is_of_axes(std::string_view key) {
  return (key.starts_with("dynamics.x.") || key.starts_with("dynamics.y.")) &&
         !key.ends_with("gantry_mass_g");
}

Status resolve_masses(Draft& draft) {
  if (Status checked = check_forms(draft); !checked || !draft.settings.swing.has_masses()) {
    return checked;
  }
  if (Status checked = check_drives(draft); !checked) {
    return checked;
  }
  const Result<dynamics::ModeFrame> frame = frame_of_masses(draft.settings);
  if (!frame) {
    return conflict(draft, {"dynamics.of", "dynamics.tool_mass_g"},
                    fmt::format("masses and stiffnesses make no machine that swings: {}",
                                frame.error().message));
  }
  constexpr double kMuch = 0.1;
  if (frame->left_out() > kMuch) {
    draft.settings.notes.push_back(
        {place_of(draft, "dynamics.a.damping_n_s_mm").value_or(SourcePlace{draft.printer_file, 0}),
         fmt::format("{:.0f} % of the damping couples the modes, which unflex leaves out; "
                     "dampings in proportion to the stiffnesses do not",
                     100.0 * frame->left_out())});
  }
  for (std::size_t axis = 0; axis < 2; ++axis) {
    if (Status taken = take_modes(modes_of(*frame, axis), kAxisKeys[axis][0],
                                  draft.settings.dynamics[axis], draft);
        !taken) {
      return taken;
    }
  }
  return {};
}

}  // namespace unflex::machine
