// The tower that unflex tune has printed: a hollow square of single walls with rounded corners.
// Each of its bands is the same, apart from its height, and each is compensated for other values.
//
//        ← top: shows Y, printed towards −X
//      ╭───────────────╮
//      │               │ right: shows X, printed towards +Y
//      │               │
//      ╰───────────────╯
//        → bottom: shows Y, printed towards +X
//
// A wall begins slowly behind a corner, comes up to speed, makes its waves and goes on straight at
// the same speed. Whatever shows in that last part is the swing of the axis across the wall.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "unflex/core/axes.hpp"
#include "unflex/core/error.hpp"
#include "unflex/core/firmware.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/tune/trial.hpp"

namespace unflex::tune {

// G-code that stands around a print, and where the print is.
struct Codes {
  std::string start;  // heats, homes and primes
  std::string end;    // cools
  XY center_mm = {};
};

// Limits of a printer, mm/s².
struct AccelLimits : XY {
  double print = 0.0;
  double travel = 0.0;
};

// Which printer a tower is for.
struct TowerPrinter {
  Firmware firmware = Firmware::klipper;
  Codes codes;
  double accel_mm_s2 = 5000.0;  // of the print
  // The printer's own limits, if the tower is to go beyond them. They are back when it is done.
  std::optional<AccelLimits> own = {};
  double max_velocity_mm_s = 300.0;
  double nozzle_diameter_mm = 0.4;
  double filament_diameter_mm = 1.75;
  std::size_t layers_per_band = 8;  // at least 2
};

struct TowerSettings : TowerPrinter {
  Axes<Trial> trials;  // X's and Y's
};

// The straight part of a wall behind its waves.
struct Wall {
  bool shows_x = false;  // it runs along Y, so that waves in it are the X axis'
  double at_mm = 0.0;    // where the outer wall's line is: X if it shows X, otherwise Y
  double from_mm = 0.0;  // where the part begins and ends, in the order of printing
  double to_mm = 0.0;
  double speed_mm_s = 0.0;
};

struct Tower {
  std::string start;               // start code, modes and limits
  std::string base;                // brim and base
  std::vector<std::string> bands;  // each from standstill to standstill, at the same place
  std::string foot;                // from the last band on
  // Moves to the beginning of a band, number 1 … . Behind `start` these moves stand in for the
  // tower below the band.
  [[nodiscard]] std::string approach(std::size_t number) const;
  std::vector<double> bottoms_mm;  // height at which each band begins
  std::vector<Wall> walls;         // of a tower for axes: the right one and the bottom one
  double side_mm = 0.0;            // of the square
  double brim_mm = 0.0;            // how far the brim reaches beyond it
  XY begin_mm;                     // where each band begins and ends
};

// The comments around the G-code of a band, each behind a standstill. Numbers count from 1.
[[nodiscard]] std::string band_begins(std::size_t number);
[[nodiscard]] std::string band_ends(std::size_t number);

// The tower as a slicer would write it, not compensated.
[[nodiscard]] Tower tower(const TowerSettings& settings);

// The facts that the file of a tower tells: enough to read it and to make the next tower. An error
// of kind input if the file is no tower.
struct TowerRecord {
  Axes<Trial> trials;
  Codes codes;
};
[[nodiscard]] Result<TowerRecord> record_of(const std::string& text, const std::string& name);

// The start code and the end code of a sliced print. The start code stands before the first layer.
// The end code stands behind the last move that lays filament. Its moves are left out, since they
// are for another height. The center is that of the laid filament. An error of kind input if the
// print lays none.
[[nodiscard]] Result<Codes> codes_of(const std::string& print, const std::string& name,
                                     Firmware firmware);

// The codes for a printer of which only temperatures are known. bed_temp_c: 0 if the bed is not
// heated.
[[nodiscard]] Codes plain_codes(double nozzle_temp_c, double bed_temp_c);

}  // namespace unflex::tune
