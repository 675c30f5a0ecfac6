// Records of a printer's resonances, as people have them in files.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "unflex/core/error.hpp"

namespace unflex::identify {

enum class Axis { x, y };

[[nodiscard]] char letter(Axis axis);

// X, Y and Z of the nozzle, in mm.
using Place = std::array<double, 3>;

// Samples of an accelerometer at even times.
struct Recording {
  double rate_hz = 0.0;
  std::array<std::vector<double>, 3> accel;  // X, Y, Z, of equal length, in any unit
  // RepRapFirmware turns the sensor's axes into the printer's (M955 I).
  bool is_along_axes = false;
};

// Power spectral densities as Klipper computes them from a recording (shaper_calibrate.py): Welch's
// method over Kaiser windows of 1 / step_hz.
struct Spectrum {
  double step_hz = 0.0;                        // density k is at k · step_hz
  std::array<std::vector<double>, 3> density;  // X, Y, Z, in any unit
  // SHAPER_CALIBRATE divides the density by the frequency before it writes.
  bool is_normalized = false;
};

struct DataSet {
  std::string name;  // name of the file; with several data sets in it, also of the column
  std::variant<Recording, Spectrum> data;
  std::optional<Axis> axis;       // axis that the name tells
  std::optional<Place> place_mm;  // place that the name tells
  bool is_diagonal = false;       // a test of a belt, neither along X nor along Y
  std::vector<std::string> notes;
};

// Reads a file of records, whatever its name:
//   Klipper's raw recording, also Shake&Tune's   #time,accel_x,accel_y,accel_z
//   Klipper's spectrum                           freq,psd_x,psd_y,psd_z,psd_xyz[,shapers:,…],
//                                                or one column for each of several points
//   Shake&Tune's .stdata                         lines of JSON, packed by Zstandard
//   RepRapFirmware's M956                        Sample,X,Y,Z … Rate 1344, overflows 0
// Errors are of kind input: another header, a line that is no row of numbers, too few rows.
[[nodiscard]] Result<std::vector<DataSet>> parse_records(std::string_view bytes,
                                                         const std::string& file);

// The density of the acceleration, as a test of Klipper's measured it: not divided by the
// frequency, and of a recording by Klipper's own method.
[[nodiscard]] Spectrum spectrum_of(const DataSet& set);

// The axis a file's name tells: "raw_data_x_1.csv", "resonances_axis=0.000,1.000,0.000.csv".
[[nodiscard]] std::optional<Axis> axis_in_name(std::string_view file);

// The place a file's name tells: "resonances_x_100.000_50.000_20.000_1.csv" by Klipper, and
// "raw_data_x_at_100_50_20.csv" where the name is the user's.
[[nodiscard]] std::optional<Place> place_in_name(std::string_view file);

}  // namespace unflex::identify
