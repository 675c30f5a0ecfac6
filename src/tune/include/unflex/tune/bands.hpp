// A tower compensated band by band, and the walls that a printer makes of it.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/tune/pressure_tower.hpp"
#include "unflex/tune/tower.hpp"

namespace unflex::tune {

// A band as it was sliced and as it was compensated, each a whole file, with the tower's start code
// and its foot. The first band's file also holds the tower's base. The other files go straight to
// where their band begins.
struct Band {
  machine::Settings made_for;
  std::string sliced;
  std::string compensated;
};

// The settings that each band is compensated with: its values in the trials, by the exact design of
// one mode for each axis. A base that suits several models would hide the waves. All else in
// `settings` holds.
[[nodiscard]] std::vector<machine::Settings> settings_of_bands(const tune::TowerSettings& tower,
                                                               const machine::Settings& settings);
// The settings that each band is compensated with, for a hotend whose pressure is linear. Pressure
// is written into the runs on all firmwares.
[[nodiscard]] std::vector<machine::Settings> settings_of_bands(
    const tune::PressureTowerSettings& tower, const machine::Settings& settings);

// Compensates each band of the tower with its settings. workers: how many threads. Errors: those of
// compensate(), and a rule that is broken, of kind internal.
[[nodiscard]] Result<std::vector<Band>> compensate_bands(
    const tune::Tower& tower, const std::vector<machine::Settings>& settings, unsigned workers,
    Progress& progress);

// The bands as one file.
[[nodiscard]] std::string join_bands(const std::vector<Band>& bands);

// The axes of a printer as they are.
struct TrueAxes {
  std::array<double, 2> freq_hz{};  // X, Y
  std::array<double, 2> damping_ratio{};
};

// The straight part of a wall in a band's last layer: how far the nozzle is inside of the line at
// every kRelief_mm from the part's begin on.
inline constexpr double kRelief_mm = 0.1;
struct Relief {
  std::vector<double> inward_um;

  // From the deepest trough to the highest crest, µm.
  [[nodiscard]] double height_um() const;
};

// The walls that a printer with these axes makes of the bands: for each band the relief of each of
// the tower's walls. It simulates the compensated file's replay.
[[nodiscard]] Result<std::vector<std::vector<Relief>>> print_bands(const std::vector<Band>& bands,
                                                                   const tune::Tower& tower,
                                                                   const TrueAxes& axes,
                                                                   Progress& progress);

// The hotend of a printer as it is.
struct TrueHotend {
  double advance_s = 0.0;
  double dead_time_s = 0.0;
};

// A band's outer ring in its last layer: how far its width is off in each bin, as a share. The
// first and the last millimetre have none.
struct RingWidths {
  static constexpr double kBin_mm = 0.4;
  std::vector<double> errors;

  // The error that an eye sees: the largest mean of neighbouring bins, without its sign.
  static constexpr std::size_t kBinsSeen = 2;
  [[nodiscard]] double seen() const;
};

// The widths that a printer with this hotend makes of the bands. It simulates the compensated
// file's replay. The printer's axes are those that the bands are made for.
[[nodiscard]] Result<std::vector<RingWidths>> print_bands(const std::vector<Band>& bands,
                                                          const TrueHotend& hotend,
                                                          Progress& progress);

}  // namespace unflex::tune
