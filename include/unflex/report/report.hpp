// The result of a run of the program, as plain data, and its JSON.
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
#include "unflex/verify/measured.hpp"

namespace unflex::report {

// Contour error of the nominal axes while extruding, before lines are made of the base. It shows
// the cost of a base that suits a band of frequencies.
struct Robustness {
  double rms_mm = 0.0;
  double nominal_rms_mm = 0.0;  // on the base optimised for the nominal axes alone
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

// A run that kept its original moves, and why.
struct Fallback {
  std::size_t first_line = 0;
  std::size_t last_line = 0;
  std::string reason;
};

// The gain from frequencies that are known better, where the timing is free.
struct NarrowerBand {
  double freq_error = 0.0;  // their band
  double saves_s = 0.0;     // of print time, as far as a sample of runs tells
};

// The result of the timing, where a tolerance of the nozzle chooses it.
struct FreeTiming {
  double tolerance_mm = 0.0;         // 0: the timing is as sliced
  std::size_t pieces_as_sliced = 0;  // runs, or parts of long ones, that keep their timing
  std::vector<Fallback> as_sliced;   // at most 1000 of them
  std::size_t pieces_scaled = 0;     // with a scaled timing, although the optimal one is asked for
  std::vector<Fallback> scaled;      // at most 1000 of them
  std::optional<NarrowerBand> narrower;
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
  // The allowed rate; infinity: not limited.
  double max_hz = std::numeric_limits<double>::infinity();
  double max_total_hz = std::numeric_limits<double>::infinity();
  double max_shared_hz = std::numeric_limits<double>::infinity();  // while more than one moves
};

struct LineBudget {
  double max_lines_per_s = 0.0;
  std::size_t places_above = 0;
  std::vector<AboveBudget> above;  // at most 1000 are listed
  // Distance of the nozzle, across the path, from its place if the base moved exactly as optimised,
  // while filament is laid. It shows the cost of few lines and of the printer's grid.
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

// Facts about the printer that the result was computed for and is compared with.
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
  // The printer's own limits of a motor of X or Y, and the origin of the second limit.
  double motor_max_velocity_mm_s = 0.0;
  double motor_max_accel_mm_s2 = 0.0;
  std::string motor_max_accel_origin;
  std::string travel;        // "X 0 to 235, Y 0 to 235 mm"; empty if it is not known
  std::string lines_source;  // what reads the lines: "Klipper from its own storage"
  double max_lines_per_s = 0.0;
};

// Results of the stretches between stops that could be compensated.
struct Runs {
  std::size_t total = 0;
  std::size_t compensated = 0;
  std::size_t fallback = 0;         // they kept their original moves
  std::vector<Fallback> fallbacks;  // at most 1000 are listed
  std::size_t windows_total = 0;
  std::size_t windows_solved = 0;
  std::size_t windows_fallback = 0;  // windows of runs that kept their original moves
  std::map<std::string, std::size_t>
      kept_moves;  // reason → moves outside runs ("wipe", "Z move" …)
};

struct Solver {
  std::string engine;  // "ipopt 3.11.9"; empty if nothing was to be solved
  std::size_t iterations = 0;
  SolverCheck check;
};

// Results of fitting the print to a filament that is not a full cylinder. The fit comes before all
// other work.
struct FittedFilament {
  double sliced_mm = 0.0;  // of moves that print
  double fitted_mm = 0.0;
  double material_mm3 = 0.0;
  double least_factor = 1.0;
  double most_factor = 1.0;
  double end_mm = 0.0;  // where the print ends on the filament
};

// The cost of the work to this process and its children.
struct Performance {
  double wall_s = 0.0;
  double cpu_s = 0.0;
  double print_s_per_wall_s = 0.0;
  double peak_rss_mb = 0.0;
};

// The print on machines that are not as the settings say.
struct OtherMachines {
  // The output is made for frequencies up to this share off, either way; 0: for exact ones.
  double freq_error = 0.0;
  std::vector<Sensitivity> sensitivity;  // by rising error
  std::vector<PlantDeviation> plants;    // in the order of the settings
  std::optional<Robustness> robustness;  // set if the base is to suit more models than one
};

struct Report {
  std::string command;  // "compensate", "verify"
  std::string version;
  std::string input;
  std::string output;
  std::string firmware;
  std::vector<Setting> printer;  // every setting in force
  PrinterFacts facts;

  verify::Measured measured;
  OtherMachines others;

  Runs runs;
  FreeTiming free_timing;
  ExtrudedPath extruded_path;
  std::vector<UnknownCommand> unknown_commands;  // by their first lines
  LineBudget line_budget;
  Solver solver;

  // Words to type behind SET_INPUT_SHAPER after the print: "SHAPER_FREQ_X=...". The output leaves a
  // shaper off whose settings nobody has given. Empty if there is nothing to type.
  std::string shaper_left_off;

  std::optional<FittedFilament> fitted_filament;
  StepRates step_rates;
  std::optional<Temperature> temperature;  // if the settings have a model of the hotend
  std::optional<double> max_flow_mm3_s;    // what the hotend melts, if the settings say so

  Performance performance;

  std::vector<std::string> violations;  // "file:line: message"
  std::size_t violation_count = 0;
  std::vector<std::string> warnings;

  std::optional<Recording> recording;  // where the nozzle strays most, and what shapers would do
};

// Whether the timing is free and the nozzle keeps to its tolerance, with what rounding adds.
[[nodiscard]] inline bool keeps_tolerance(const Report& report) {
  constexpr double kRounded = 1.05;
  const double tolerance_mm = report.free_timing.tolerance_mm;
  return tolerance_mm > 0.0 &&
         report.measured.compensated.extruding.contour_p999_mm <= kRounded * tolerance_mm;
}

// The report as JSON with the keys of docs/report.md, two spaces of indentation, final newline.
[[nodiscard]] std::string to_json(const Report& report);

// The report as a self-contained page for people. `recording` must be set.
[[nodiscard]] std::string to_html(const Report& report);

// A summary for people, a dozen lines.
[[nodiscard]] std::string to_text(const Report& report);

}  // namespace unflex::report
