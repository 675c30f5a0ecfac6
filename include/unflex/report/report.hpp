// What a run of the program has to tell, as plain data, and its JSON.
#pragma once

#include <cstddef>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/report/recording.hpp"
#include "unflex/report/temperature.hpp"

namespace unflex::report {

struct DeviationRow {
  double contour_max_mm = 0.0;
  double contour_p99_mm = 0.0;
  double contour_rms_mm = 0.0;
  double tracking_max_mm = 0.0;
  double tracking_rms_mm = 0.0;
  double duration_s = 0.0;
  std::size_t contour_max_line = 0;
};

// Contour error of the nominal axes while extruding, before lines are made of the base. It shows
// what it costs that the base suits a band of frequencies.
struct Robustness {
  double rms_mm = 0.0;
  double nominal_rms_mm = 0.0;  // on the base optimised for the nominal axes alone
};

struct DeviationRows {
  DeviationRow extruding;
  DeviationRow all;
};

// How far the nozzle passes from the corners of the sliced path.
struct CornerRow {
  std::size_t count = 0;
  double rms_mm = 0.0;
  double p99_mm = 0.0;
  double max_mm = 0.0;
  std::size_t max_line = 0;  // of the input
};

// How much wider the line of plastic is than sliced, relative to its width.
struct WidthRow {
  double rms = 0.0;
  double p99 = 0.0;
  double largest = 0.0;  // with its sign
  double wide = 0.0;     // share of the way that is off by more than 10 %
  std::size_t line = 0;  // of the input, with the largest error
};

// How far the edges of that line are off.
struct EdgeRow {
  double rms_mm = 0.0;
  double p99_mm = 0.0;
  double max_mm = 0.0;
  std::size_t line = 0;
};

// How much more filament comes out at one end of lines than is sliced there, relative to it.
struct LineEndRow {
  double rms = 0.0;
  double mean = 0.0;
};

struct LineRow {
  WidthRow width;
  EdgeRow edge;
  // With a hotend that is not as assumed.
  WidthRow less_pressure;  // 20 % lower, and higher
  WidthRow more_pressure;
  WidthRow earlier;  // dead time 2 ms shorter, but not below 0, and longer
  WidthRow later;
  LineEndRow first = {};  // over the first and the last millimetre of lines
  LineEndRow last = {};
};

// The line of plastic that comes out.
struct LaidLine {
  double length_mm = 0.0;  // of the lines that are measured
  LineRow uncompensated;   // with the printer's own pressure advance
  LineRow compensated;
};

// Contour error of extruding moves if the true frequencies are the assumed ones times 1 +
// frequency_error.
struct Sensitivity {
  double frequency_error = 0.0;
  Spread uncompensated;
  Spread compensated;
};

// Contour error of extruding moves if the axes are other models that the settings allow.
struct PlantDeviation {
  Spread uncompensated;
  Spread compensated;
};

// Volume of filament per second as a mean over 20 ms, and its change over 20 ms divided by that
// time. The lines are those of the file that the row is of.
struct FlowRow {
  double max_mm3_s = 0.0;
  std::size_t max_line = 0;
  double max_change_mm3_s2 = 0.0;
  std::size_t max_change_line = 0;
};

// How much the output's rate of filament differs from the sliced file's, as means over 10 ms of
// laying.
struct FlowDifferenceRow {
  double relative = 0.0;  // by how much the output lays more, where the two differ most
  std::size_t line = 0;   // of the input, there
  double p99 = 0.0;       // what it stays within, either way, for 99 % of the time
};

// A run that kept its original moves, and why.
struct Fallback {
  std::size_t first_line = 0;
  std::size_t last_line = 0;
  std::string reason;
};

// What frequencies that are known better would gain where the timing is free.
struct NarrowerBand {
  double freq_error = 0.0;  // their band
  double saves_s = 0.0;     // of print time, as far as a sample of runs tells
};

// What became of the timing, where it is chosen by a tolerance of the nozzle.
struct FreeTiming {
  double tolerance_mm = 0.0;         // 0: the timing is as sliced
  std::size_t pieces_as_sliced = 0;  // runs, or parts of long ones, that keep their timing
  std::vector<Fallback> as_sliced;   // at most 1000 of them
  // Likewise those whose timing is scaled, where the optimal one is asked for.
  std::size_t pieces_scaled = 0;
  std::vector<Fallback> scaled;
  std::optional<NarrowerBand> narrower;
  // While filament is laid: the contour error that 99.9 % of the time are within, and the nozzle's
  // speed relative to F.
  double contour_p999_mm = 0.0;
  double speed_p999 = 0.0;
  double speed_max = 0.0;
  std::size_t speed_max_line = 0;  // of the input

  // Whether the nozzle keeps to the tolerance, with what rounding adds; false if there is none.
  [[nodiscard]] bool is_kept() const {
    constexpr double kRounded = 1.05;
    return tolerance_mm > 0.0 && contour_p999_mm <= kRounded * tolerance_mm;
  }
};

// A stretch of the input whose lines, kept or rewritten, are more than the budget.
struct AboveBudget {
  std::size_t first_line = 0;
  std::size_t last_line = 0;
  double lines_per_s = 0.0;
};

// Length of the path in X and Y on which filament is laid.
struct ExtrudedPath {
  double total_mm = 0.0;
  double compensated_mm = 0.0;
  std::map<std::string, double> kept_mm;  // length that was kept, by reason

  // 1 if there is no extruded path.
  [[nodiscard]] double compensated_share() const {
    return total_mm > 0.0 ? compensated_mm / total_mm : 1.0;
  }
};

// A command that may do anything: a macro, a code of another firmware.
struct UnknownCommand {
  std::string command;  // "MY_MACRO", "M1234"
  std::size_t count = 0;
  std::size_t first_line = 0;
  std::size_t moves_kept = 0;  // moves after it that were kept, because their start is not known
  double kept_mm = 0.0;        // extruded path of moves_kept
};

// Steps per second, at most.
struct StepRates {
  struct Row {
    std::string motor;  // "X", "A"
    double steps_per_mm = 0.0;
    double sliced_hz = 0.0;
    std::size_t sliced_line = 0;  // of the input
    double emitted_hz = 0.0;
    std::size_t emitted_line = 0;  // of the output
  };
  std::vector<Row> motors;  // those whose steps per mm are known
  Row total;                // of all of them together, without a name
  // What is allowed; infinity: not limited.
  double max_hz = std::numeric_limits<double>::infinity();
  double max_total_hz = std::numeric_limits<double>::infinity();
  double max_shared_hz = std::numeric_limits<double>::infinity();  // while more than one moves
};

struct LineBudget {
  double max_lines_per_s = 0.0;
  std::size_t places_above = 0;
  std::vector<AboveBudget> above;  // at most 1000 are listed
  // Distance of the nozzle, across the path, from its place if the base moved exactly as optimised,
  // while filament is laid. It shows what few lines and the printer's grid cost.
  double cost_rms_mm = 0.0;
  double cost_max_mm = 0.0;
};

// Windows that a second engine has solved as well, if asked for.
struct SolverCheck {
  std::size_t windows = 0;
  double largest_gap = 0.0;            // relative gap of the objectives
  double largest_difference_mm = 0.0;  // difference of the base's positions
};

struct Setting {
  std::string key;
  std::string value;
  std::string origin;
};

// What the result was computed for, and what it is compared with.
struct PrinterFacts {
  struct Axis {
    std::string name;    // "X"
    std::string model;   // "45 Hz, ζ 0.06"
    std::string origin;  // where the frequency is from: "printer.toml:7", "--set"
  };
  std::vector<Axis> axes;
  // The printer's own input shaper: "MZV 45 Hz"; empty if its configuration has none.
  std::string shaper;
  bool shaper_unknown = false;  // it may have one that no source tells of
  // What a motor of X or Y may do by the printer's own limits, and where the second is from.
  double motor_max_velocity_mm_s = 0.0;
  double motor_max_accel_mm_s2 = 0.0;
  std::string motor_max_accel_origin;
  std::string travel;        // "X 0 to 235, Y 0 to 235 mm"; empty if it is not known
  std::string lines_source;  // what reads the lines: "Klipper from its own storage"
  double max_lines_per_s = 0.0;
};

struct Report {
  std::string command;  // "compensate", "verify"
  std::string version;
  std::string input;
  std::string output;
  std::string firmware;
  std::vector<Setting> printer;  // every setting in force
  PrinterFacts facts;

  double reference_time_s = 0.0;
  double emitted_time_s = 0.0;

  // The sliced file as this printer plays it, its own input shaper included.
  DeviationRows uncompensated;
  // The sliced file without that shaper; nullopt if none acts.
  std::optional<DeviationRows> unshaped;
  DeviationRows compensated;
  CornerRow uncompensated_corners;
  CornerRow compensated_corners;
  std::optional<LaidLine> laid_line;  // unset: nothing tells the hotend's pressure
  // The output is made for frequencies up to this share off, either way; 0: for exact ones.
  double freq_error = 0.0;
  std::vector<Sensitivity> sensitivity;  // by rising error
  std::vector<PlantDeviation> plants;    // in the order of the settings
  std::optional<Robustness> robustness;  // set if the base is to suit more models than one

  // What the compensated runs ask of a motor of X or Y at most, its largest change of speed from
  // one line to the next, and the largest acceleration that a run was allowed.
  double base_max_velocity_mm_s = 0.0;
  double base_max_accel_mm_s2 = 0.0;
  double base_max_step_mm_s = 0.0;
  double base_accel_limit_mm_s2 = 0.0;

  std::size_t runs_total = 0;  // stretches between stops that could be compensated
  std::size_t runs_compensated = 0;
  std::size_t runs_fallback = 0;
  std::size_t windows_total = 0;
  std::size_t windows_solved = 0;
  std::size_t windows_fallback = 0;  // windows of runs that kept their original moves
  std::vector<Fallback> fallbacks;   // at most 1000 are listed
  std::map<std::string, std::size_t>
      kept_moves;  // reason → moves outside runs ("wipe", "Z move" …)

  FreeTiming free_timing;

  ExtrudedPath extruded_path;
  std::vector<UnknownCommand> unknown_commands;  // by their first lines

  LineBudget line_budget;

  std::string solver_engine;  // "ipopt 3.11.9"
  std::size_t solver_iterations = 0;
  SolverCheck solver_check;

  // What to type behind SET_INPUT_SHAPER after the print, since the output leaves a shaper off that
  // nobody has told of: "SHAPER_FREQ_X=..."; empty if there is nothing to type.
  std::string shaper_left_off;

  std::size_t output_lines = 0;
  std::size_t output_bytes = 0;
  double max_lines_per_s = 0.0;
  double segment_ms_median = 0.0;
  double worst_run_drift_ms = 0.0;

  double input_extrusion_mm = 0.0;
  double output_extrusion_mm = 0.0;
  double worst_move_extrusion_error_mm = 0.0;
  // Distance along the path between the nozzle and the place whose filament comes out, as sliced
  // and as emitted.
  struct FilamentLag {
    double rms_mm = 0.0;
    double max_mm = 0.0;
    std::size_t max_line = 0;  // of the input
  };
  FilamentLag uncompensated_lag;
  FilamentLag compensated_lag;
  // What became of the print's filament, where it was fitted to one that is not a full cylinder
  // before all else.
  struct FittedFilament {
    double sliced_mm = 0.0;  // of moves that print
    double fitted_mm = 0.0;
    double material_mm3 = 0.0;
    double least_factor = 1.0;
    double most_factor = 1.0;
    double end_mm = 0.0;  // where the print ends on the filament
  };
  std::optional<FittedFilament> fitted_filament;
  FlowRow uncompensated_flow;
  FlowRow compensated_flow;
  std::optional<FlowDifferenceRow> flow_difference;  // nullopt if nothing was compared
  StepRates step_rates;
  std::optional<Temperature> temperature;  // if the settings have a model of the hotend
  std::optional<double> max_flow_mm3_s;    // what the hotend melts, if the settings say so

  double wall_s = 0.0;
  double cpu_s = 0.0;
  double print_s_per_wall_s = 0.0;
  double peak_rss_mb = 0.0;

  std::vector<std::string> violations;  // "file:line: message"
  std::size_t violation_count = 0;
  std::vector<std::string> warnings;

  std::optional<Recording> recording;  // where the nozzle strays most, and what shapers would do
};

// The report as JSON with the keys of docs/report.md, two spaces of indentation, final newline.
[[nodiscard]] std::string to_json(const Report& report);

// The report as a self-contained page for people. `recording` must be set.
[[nodiscard]] std::string to_html(const Report& report);

// A summary for people, a dozen lines.
[[nodiscard]] std::string to_text(const Report& report);

}  // namespace unflex::report
