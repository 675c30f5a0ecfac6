// A user's first questions: is it better than what the printer does now, where is it worst, and is
// it safe to print?
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "unflex/report/report.hpp"

namespace unflex::report {

// Contour error while filament is laid, RMS.
struct Comparison {
  double now_mm = 0.0;  // the sliced file as this printer plays it
  double compensated_mm = 0.0;
  std::optional<double> zv_mm;  // under a ZV shaper, if that was measured
};

// Where the printer's own shaper acts, the file is compared with that shaper, and ZV is left out.
struct Better {
  std::string now;  // "without an input shaper"
  Comparison exact;
  std::optional<Comparison> off;  // the worse of both if the frequencies are 5 % off
  // How far the edges of the line of plastic are off, RMS, where that is known.
  std::optional<Comparison> edge;
  // How many times smaller the error is than now; 0 if nothing is left of it.
  [[nodiscard]] double times() const;
};

// How many times smaller the error is than now; 0 if nothing is left of it.
[[nodiscard]] double times_smaller(const Comparison& comparison);
[[nodiscard]] Better better(const Report& report);

// Texts for a free timing: "9.8s → 6.3s to print, 36 % less; the nozzle may stray 20 µm and keeps
// to it", and the time that a narrower band of frequencies would save, if it is worth it. Empty:
// the timing is as sliced.
[[nodiscard]] std::vector<std::string> faster_texts(const Report& report);

// The height of waves that an eye sees on a wall that is held into light from one side
// (docs/tune.md).
inline constexpr double kSeen_mm = 0.008;

// A remark on a print that compensating hardly improves: as sliced it strays less than an eye sees,
// but for one hundredth of the time. nullopt: any other print, or one made for speed.
[[nodiscard]] std::optional<std::string> hardly_worth_it(const Report& report);

// A text on the width of the line: how far it is off, or how to find out.
[[nodiscard]] std::string width_text(const Report& report);

struct Worst {
  std::optional<Place> compensated;
  std::optional<Place> now;
  // Largest before the first layer that the slicer names; nullopt if nothing is laid there.
  std::optional<BeforeAfter> start;
};
[[nodiscard]] Worst worst(const Report& report);

// The number of a layer as the slicer counts, from 1 on; 0 before its first layer.
[[nodiscard]] std::size_t slicers_layer(const Recording& recording, std::size_t layer);

// "layer 12", as slicers_layer() counts.
[[nodiscard]] std::string layer_text(const Recording& recording, std::size_t layer);
// "line 812, layer 12, External perimeter, at X100.2 Y98.1"
[[nodiscard]] std::string place_text(const Recording& recording, const Place& place);

struct Safe {
  bool is_safe = true;           // no rule is broken
  double times_own_accel = 0.0;  // acceleration asked of the motors, over the printer's own limit
  std::vector<std::string> reasons;  // a sentence each
};
[[nodiscard]] Safe safe(const Report& report);

// "X 45 Hz, ζ 0.06 (printer.toml:7), Y 45 Hz, ζ 0.06 (--set), both up to 10 % off"
[[nodiscard]] std::string made_for_text(const Report& report);

}  // namespace unflex::report
