// The figures of a verification, as plain values.
//
// Lines are those of the sliced file, if nothing else is said.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace unflex::verify {

// How far a nozzle strays from a path (unflex/verify/deviation.hpp). Weighted by time: every sample
// counts for the time it stands for.
struct DeviationStats {
  double contour_max_mm = 0.0;
  double contour_p99_mm = 0.0;  // from a histogram with cells less than 1 % apart
  double contour_p999_mm = 0.0;
  double contour_rms_mm = 0.0;
  double tracking_max_mm = 0.0;
  double tracking_rms_mm = 0.0;
  double duration_s = 0.0;           // time that the statistics cover
  std::size_t contour_max_line = 0;  // nearest to the largest contour error
};

// How far the nozzle is above or below its plan while filament is laid.
struct HeightStats {
  double max_mm = 0.0;
  double rms_mm = 0.0;
};

struct Deviation {
  DeviationStats extruding;  // while the text that is played lays filament
  // While the reference moves in X or Y. For a whole file, also while the base is held after its
  // end.
  DeviationStats all;
  // Set where modes move the nozzle in Z, too.
  std::optional<HeightStats> height = {};
};

// How far the nozzle passes from the corners of the path. All corners have the same weight.
struct CornerStats {
  std::size_t count = 0;
  double rms_mm = 0.0;
  double p99_mm = 0.0;  // from a histogram with cells less than 1 % apart
  double max_mm = 0.0;
  std::size_t max_line = 0;  // leads to the corner of max_mm
};

// Length of a bin.
inline constexpr double kWidthBin_mm = 0.4;

// How much wider the line of plastic is than sliced, relative to its width, in bins. The first and
// the last millimetre of each line are left out.
struct WidthStats {
  double rms = 0.0;
  double p99 = 0.0;      // 99 % of the bins are off by less
  double largest = 0.0;  // with its sign
  double wide = 0.0;     // share of the bins that are off by more than 10 %
  std::size_t line = 0;  // with the largest error
};

// The distance of the nozzle from the path, and half of the error of the line's width.
struct EdgeStats {
  double rms_mm = 0.0;
  double p99_mm = 0.0;
  double max_mm = 0.0;
  std::size_t line = 0;
};

// The excess of filament at one end of the lines over the sliced amount, relative to it. Each line
// of at least 3 mm counts once.
struct EndStats {
  double rms = 0.0;
  double mean = 0.0;
};

// Hotends that differ from the model.
enum class OtherHotend {
  less_pressure,  // 20 % lower
  more_pressure,
  earlier,  // dead time 2 ms shorter, but not below 0
  later,
};
inline constexpr std::size_t kOtherHotends = 4;

// The line of plastic that comes out.
struct LineStats {
  double length_mm = 0.0;  // of the bins; 0: nothing is known of the line
  WidthStats width;
  EdgeStats edge;
  EndStats first;  // over the first millimetre of lines, or a little more
  EndStats last;   // over the last one
  std::array<WidthStats, kOtherHotends> other;

  [[nodiscard]] bool is_known() const { return length_mm > 0.0; }
  [[nodiscard]] const WidthStats& width_with(OtherHotend hotend) const {
    return other[static_cast<std::size_t>(hotend)];
  }
};

// Distance along the sliced path between the nozzle and the place whose filament comes out, while
// the reference lays filament.
struct LagStats {
  double rms_mm = 0.0;  // weighted by time
  double max_mm = 0.0;
  std::size_t max_line = 0;
};

// Volume of filament per second in moves of X and Y, as a mean over 20 ms, and its rate of change:
// the change of the mean within 20 ms, divided by that time. The lines are those of the file that
// is measured: the one that is played at the end of the mean, and the one in the middle of the
// change.
struct FlowStats {
  double max_mm3_s = 0.0;
  std::size_t max_line = 0;
  double max_change_mm3_s2 = 0.0;
  std::size_t max_change_line = 0;
};

// How much the output's rate of filament differs from the sliced file's at the same time, by the
// means of both over 10 ms in which the sliced file lays filament all the time.
struct FlowDifference {
  // By how much the output lays more, relative to the sliced file, where the two differ most.
  double relative = 0.0;
  std::size_t line = 0;  // in the middle of these 10 ms
  double p99 = 0.0;      // the difference stays within this, either way, for 99 % of the time
};

// The nozzle's speed while it lays filament, relative to the F of the nearest part of the path.
struct FeedStats {
  double p999 = 0.0;  // the ratio is below this for 99.9 % of the time
  double max = 0.0;
  std::size_t max_line = 0;
};

// The contour error of extruding moves in a part of the print.
struct PartError {
  double rms_mm = 0.0;
  double duration_s = 0.0;
};

// Errors by places. Parts where nothing is laid are left out.
inline constexpr double kSquare_mm = 20.0;
inline constexpr double kBand_mm = 1.0;

struct PlaceErrors {
  struct Square {
    double x_mm = 0.0;  // its middle
    double y_mm = 0.0;
    PartError error;
  };
  struct Band {
    double from_mm = 0.0;  // its lower end
    PartError error;
  };
  std::vector<Square> squares;  // of the bed, kSquare_mm wide, by rising Y and then X
  std::vector<Band> bands;      // of the height, kBand_mm high, from below
};

// One of the two files as it is played.
struct PlayedFile : Deviation {
  CornerStats corners;
  LineStats line;
  LagStats lag;
  FlowStats flow;
  double time_s = 0.0;        // dwells included
  double extrusion_mm = 0.0;  // net filament
  // Set if the machine's frequencies change during the print.
  std::optional<PlaceErrors> places = {};
};

// The replayed base in compensated runs, over the motors of X and Y.
struct BaseStats {
  double max_velocity_mm_s = 0.0;  // mean of one move
  // Largest change of mean velocity between neighbouring moves, divided by the time between their
  // middles.
  double max_accel_mm_s2 = 0.0;
  double max_step_mm_s = 0.0;  // the change of mean velocity, which a motor takes at once
  // The largest acceleration that a run's motors were allowed; 0 without such runs.
  double accel_limit_mm_s2 = 0.0;
};

struct OutputStats {
  std::size_t lines = 0;
  std::size_t bytes = 0;
  double max_lines_per_s = 0.0;    // most lines begun in any 100 ms, × 10
  double segment_ms_median = 0.0;  // median duration of the moves inside compensated runs
};

struct Measured {
  // The sliced file as this printer plays it, its own input shaper included. Measured against the
  // firmware's plan of it.
  PlayedFile uncompensated;
  // The sliced file without the printer's shaper; nullopt if none acts.
  std::optional<Deviation> unshaped;
  // Compensated runs begin and end at rest, so each is measured against its own plan from rest to
  // rest. If the input passes into or out of the run at speed, that plan takes some ms longer.
  PlayedFile compensated;
  // How fast the nozzle goes in runs whose timing is free.
  FeedStats compensated_feed;
  // Compensated runs in the timing as sliced, each against its own plan as in `compensated`.
  // nullopt if none lays filament for 10 ms.
  std::optional<FlowDifference> flow_difference;
  BaseStats base;
  OutputStats output;
  // Largest filament error of one move or one run of the input. An error that the output's lines
  // cannot resolve in time does not count.
  double worst_move_extrusion_error_mm = 0.0;
  // Longest lag or lead of the nozzle against the plan of its run, averaged over 0.1 s.
  double worst_run_drift_s = 0.0;
};

}  // namespace unflex::verify
