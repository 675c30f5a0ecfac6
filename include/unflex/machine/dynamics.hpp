// How the nozzle swings on each axis, and what changes it while a print goes on.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/axes.hpp"

namespace unflex::machine {

// The most modes that an axis can have.
inline constexpr std::size_t kMostModes = 3;

// One of several modes of an axis. The gains of an axis add up to 1.
struct ModeSettings {
  double freq_hz = 0.0;
  double damping_ratio = 0.0;
  double gain = 0.0;
};

// Another model that the axis may have, and how probable it is.
struct PlantSettings {
  double share = 0.0;
  std::vector<ModeSettings> modes;
};

// The frequency of an axis at some places of the nozzle. Between two points it is linear, and
// beyond the first and the last one constant.
struct FrequencyMap {
  char along = 'z';             // 'x', 'y' or 'z'
  std::vector<double> at_mm;    // increasing
  std::vector<double> freq_hz;  // one for each of at_mm

  // place_mm: along the map's direction.
  [[nodiscard]] double hz_at(double place_mm) const;
  // Whether the frequency changes while the nozzle moves in X or Y.
  [[nodiscard]] bool is_over_bed() const { return along != 'z'; }
};

// All that an axis' frequencies may depend on while a print goes on.
struct MachineState {
  double printed_g = 0.0;      // lies on the bed
  double height_mm = 0.0;      // of the nozzle
  Axes<double> place_mm = {};  // of the nozzle over the bed
  int tool = 0;                // in use
};

// A printer file gives either freq_hz and damping_ratio, or mass_g, stiffness_n_mm and
// damping_n_s_mm, which are converted when read, or several modes. Then freq_hz and damping_ratio
// are those of the mode with the largest gain.
struct AxisDynamics {
  double freq_hz = 45.0;
  double damping_ratio = 0.06;
  std::vector<ModeSettings> modes = {};
  std::vector<PlantSettings> plants = {};  // besides the axis as given, which has the rest
  // Mass that moves along the axis and carries the print, without it: a bed. The frequencies are
  // those of the empty bed. 0: the axis does not carry the print.
  double moving_mass_g = 0.0;
  std::vector<FrequencyMap> map = {};  // at most one for each direction

  // The frequency in this state, relative to freq_hz: the product of what mass, height and place
  // make of it.
  [[nodiscard]] double frequency_share(const MachineState& state) const;
  // What the place alone makes of it.
  [[nodiscard]] double share_at(const Axes<double>& place_mm) const;
  [[nodiscard]] bool changes() const { return moving_mass_g > 0.0 || !map.empty(); }
  [[nodiscard]] double slowest_hz() const;
  [[nodiscard]] double fastest_hz() const;
  // The node period at which a window follows all modes: a twentieth of the period of one with a
  // gain of 1, and up to an eleventh where the gain is small.
  [[nodiscard]] double good_period_ms() const;
  // "45 Hz, ζ 0.06", or that of each mode with its gain.
  [[nodiscard]] std::string description() const;
};

// What a motor drives: a belt or a screw, and the carriage on it.
struct DriveSettings {
  double carriage_mass_g = 0.0;
  std::optional<double> stiffness_n_mm;  // unset: so stiff that it does not swing
  double damping_n_s_mm = 0.0;
};

inline constexpr std::string_view kOfAxes = "axes";
inline constexpr std::string_view kOfMasses = "masses";

// What swings. With masses on the drives of all motors, the modes need not lie along the axes.
// AxisDynamics then has what each axis shows of them, and is not given.
struct SwingSettings {
  std::string of{kOfAxes};  // or kOfMasses
  std::optional<double> tool_mass_g;
  Axes<double> gantry_mass_g;           // moves with the tool along that axis alone
  std::array<DriveSettings, 3> drives;  // of the motors, in the order of Motors

  [[nodiscard]] bool has_masses() const { return of == kOfMasses; }
};

// The tools of a tool changer are numbered from 0 on.
inline constexpr int kMostTools = 16;

// What is special about one tool of a tool changer. What is not set is as with the printer itself.
struct ToolSettings {
  int number = 0;
  // A tool with either of them swings in one mode.
  Axes<std::optional<double>> freq_hz = {};
  Axes<std::optional<double>> damping_ratio = {};
  // Where its nozzle is, seen from that of a tool without offset. The firmware makes up for it, so
  // a print tells places of the nozzle, and the carriage is at the place less the offset.
  Axes<double> offset_mm = {};
};

// The shares by which the axes' frequencies and damping ratios may be off, either way.
struct DynamicsError {
  std::optional<double> freq;  // unset: Settings::freq_error()
  double damping = 0.0;
};

// A second mode that still rings once the axes are compensated. It hangs behind the modes of
// `dynamics`. The base is then shaped against it. 0 Hz: there is no second mode.
struct SecondSettings {
  Axes<double> freq_hz;
  Axes<double> damping_ratio{0.05, 0.05};
  std::string shaper = "zv";  // "none": the mode is told of and verified, but not shaped
};

}  // namespace unflex::machine
