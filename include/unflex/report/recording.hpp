// Data for a print's page besides its figures: the paths with their deviations, the worst places,
// and the results of input shapers. Its size is bounded, whatever the print.
//
//   before, after   the sliced file as the printer plays it, and the compensated one
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "unflex/core/axes.hpp"

namespace unflex::report {

// Contour error over the time in which filament is laid.
struct Spread {
  double max_mm = 0.0;
  double rms_mm = 0.0;
};

struct BeforeAfter {
  Spread before;
  Spread after;
};

// A layer; layers are in the order of the print.
struct LayerRow {
  double z_mm = 0.0;
  std::size_t first_line = 0;
  BeforeAfter spread;
  std::size_t paths_end = 0;  // end of its paths in LayerPaths::bytes
};

// The paths of all layers, one layer after the other, each a sequence of paths without a gap:
//
//   path      feature, count, first line (from the path before), last line (from the first),
//             x, y (from the last point of the path before), and `count` points
//   point     x, y (from the point before), before, after
//
// Numbers are LEB128, coordinates zigzag in hundredths of a mm; before and after are one byte each,
// the largest deviation on the way to the point (deviation_code()). At the beginning of every layer
// "before" is zero.
struct LayerPaths {
  std::string bytes;
  std::size_t layer_step = 1;  // only every n-th layer is stored
  // The print's rectangle: nearly all of the paths' length lies inside.
  Axes<double> min_mm, max_mm;
  double tolerance_mm = 0.0;  // the largest distance of a left-out point from what is drawn
};

// Logarithmic, 15 steps to the double: code c stands for 0.05 µm · 2^(c/15); 0 for all below.
[[nodiscard]] unsigned char deviation_code(double squared_mm2);

struct FeatureRow {
  std::string name;  // the slicer's name for it; empty if it gives none
  double duration_s = 0.0;
  BeforeAfter spread;
};

// A moment around a place. Coordinates are relative to the place.
struct Moment {
  double time_s = 0.0;  // since the reference was at the place
  double contour_mm = 0.0;
  Axes<double> reference_mm, base_mm, nozzle_mm;
};

struct Place {
  std::size_t line = 0;
  std::size_t layer = 0;
  std::size_t feature = 0;
  Axes<double> xy_mm;
  double z_mm = 0.0;
  double before_mm = 0.0, after_mm = 0.0;  // largest contour error there
  std::vector<Moment> before, after;
};

// Time during which the contour error is between this cell's border and the next cell's.
struct HistogramCell {
  double from_mm = 0.0;
  double before_s = 0.0;
  double after_s = 0.0;
};

// How well one method (none, unflex, an input shaper) would do if the true frequencies differed
// from those of the settings.
struct Contender {
  std::string name;
  std::vector<Spread> spreads;  // one for each of Recording::frequency_errors, or none
  bool drawn = false;           // in the figure too, not only in the table
  // How far the nozzle passes from sharp corners if the frequencies are those of the settings;
  // unset if there are no corners, or if it is not known.
  std::optional<double> corner_rms_mm = std::nullopt;
  bool printers_own = false;  // the shaper that the printer has now
};

struct Recording {
  std::vector<LayerRow> layers;
  // The number of layers before the first one that the slicer names. They are lines that prime the
  // nozzle. 0 if the slicer names none.
  std::size_t start_layers = 0;
  LayerPaths paths;
  std::vector<FeatureRow> features;
  // The worst first, without those of the start.
  std::vector<Place> worst_before, worst_after;
  std::vector<HistogramCell> histogram;
  std::vector<double> frequency_errors;  // 0.05: the true ones are 5 % above
  // First the sliced file without a shaper, then the compensated one, then the shapers.
  std::vector<Contender> contenders;
  double shapers_measured_s = 0.0;  // print time for which the shapers were measured
};

}  // namespace unflex::report
