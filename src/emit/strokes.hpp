// From the base's continuous motion to the straight strokes that a run is written as.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "unflex/emit/emit_options.hpp"
#include "unflex/emit/run.hpp"
#include "vertices.hpp"

namespace unflex::emit {

// One line to be: where the machine shall be at its end, and when.
struct Stroke {
  double end_s = 0.0;  // since the start of the run
  XY place_mm = {};
  double z_mm = 0.0;
  double e_mm = 0.0;        // filament since the start of the run
  double speed_mm_s = 0.0;  // after M220
  int feed_decimals = 0;    // digits F needs
  std::size_t events = 0;   // how many of the run's events stand before the stroke, in all
  bool is_skipped = false;  // the firmware leaves its way to the next move

  [[nodiscard]] gcode::Position end_mm() const { return {place_mm.x, place_mm.y, z_mm, e_mm}; }
};

// Decimals of E in a line.
inline constexpr int kFilamentDecimals = 5;
// Marlin adds what a relative line extrudes to the reading of E in single precision (gcode.cpp,
// get_destination_from_command). Below this reading a line loses less than 4 nm. Where E reads
// more, it is set to 0.
inline constexpr double kMostReadingOfE_mm = 64.0;

// The numbers in which a run is written: places, and speeds as F before M220.
struct Grid : Axes<AxisGrid> {
  AxisGrid z;
  double speed_factor = 1.0;  // M220 when the run begins
  bool zeroes_e = false;      // RunStart::zeroes_e
};

// The X and Y where the first line of the run begins.
[[nodiscard]] XY start_of_lines(const Run& run, const Grid& grid);

// The strokes of a run. Positions lie on the grid, but a run's last one is exactly where the last
// move ends. If the firmware skips that move, it skips the last stroke too (is_skipped). A stroke
// that would have no length after rounding is merged into its successor; at the ends of the run it
// is dropped. Empty when nothing is left.
[[nodiscard]] std::vector<Stroke> strokes(const Run& run, const Grid& grid,
                                          const EmitOptions& options);

// Gives a length to a stroke that has none: moves its end by the least distance that the firmware
// takes for a move (rules.min_steps). It moves along X or Y, whichever changes more on the way to
// the end of `next`, and towards that end. If that leaves the axis's travel, it moves the opposite
// way.
void give_length(const Stroke& next, const Grid& grid, const LineRules& rules, Stroke& stroke);

// Gives the strokes new speeds, for another Run::late_s.
void time_strokes(const Run& run, const Grid& grid, const EmitOptions& options,
                  std::vector<Stroke>& strokes);

}  // namespace unflex::emit
