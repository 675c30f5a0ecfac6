// The user's request as plain data.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/hotend/rules.hpp"
#include "unflex/identify/axis_model.hpp"
#include "unflex/machine/print_text.hpp"
#include "unflex/tune/trial.hpp"

namespace unflex::app {

enum class Command {
  compensate,
  verify,
  inspect,
  printer_init,
  printer_keys,
  printer_macros,
  line_test,
  identify,
  study,
  batch,
  tune,
  filament,
  hotend,
  kinematics,
  translate
};

// Whether the command reads a print and writes another one.
[[nodiscard]] constexpr bool writes_print(Command command) {
  return command == Command::compensate || command == Command::filament ||
         command == Command::translate;
}

// The codes the program exits with, see docs/cli.md.
enum class ExitCode : int {
  done = 0,
  usage = 1,
  input = 2,
  deviation = 3,
  internal = 4,
};

// The name that stands for stdin or stdout.
inline constexpr std::string_view kStandardStream = "-";

// The settings of `identify`.
struct IdentifyConfig {
  std::vector<std::string> records;
  std::optional<identify::Axis> axis;  // axis of all records; unset: as each record tells
  identify::Sweep sweep;
  std::optional<identify::Tower> tower;
  // Looks for the mode behind those that the printer is compensated for (identify --second).
  bool second = false;
  std::array<std::vector<identify::ModeOfAxis>, 2> known = {};  // X's and Y's, for `second`
  // Writes a test of stops for this axis instead (identify --make-test).
  std::optional<identify::Axis> make_test;
};

// The settings of `tune`, besides the tower to read (RunConfig::input, empty for the first tower).
struct TuneConfig {
  // The bands without waves, for X and Y.
  std::array<std::optional<tune::Zone>, 2> zones;
  bool asks_for_pressure = false;           // the first tower shall be for the hotend
  std::optional<tune::Zone> pressure_zone;  // the bands with even walls
  std::optional<std::string> like;          // a sliced print, for its start and end codes
  std::optional<double> nozzle_temp_c;
  double bed_temp_c = 0.0;
  std::optional<double> accel_mm_s2 = {};  // of the tower, instead of the printer's own
};

// The settings of `hotend`, besides a log (RunConfig::input) or a printer's model.
struct HotendConfig {
  std::optional<double> full_power;  // the log's value for full power
  std::optional<std::string> heater;
  std::optional<double> ambient_c;
  std::optional<double> ultimate_gain;  // --ku, counts per °C
  std::optional<double> ultimate_period_s;
  std::optional<hotend::Rule> rule;
  std::optional<double> target_c;
  std::optional<double> flow_mm3_s;
  std::optional<double> heater_w;
};

// The settings of `kinematics`, besides a print (RunConfig::input).
struct KinematicsConfig {
  std::string points;  // --fit: a table of measured places; empty: not given
};

// timing.method, if the command line has it.
enum class TimingMethod { as_set, scaled, optimal };

// One of several equal parts of a folder of prints.
struct Shard {
  unsigned number = 1;  // from 1 to count
  unsigned count = 1;
};

// The settings of `study` for the thesis' cases, or for a print (RunConfig::input).
struct StudyConfig {
  std::vector<std::string> cases;  // names; empty: all
  std::string machines;            // folder of records; empty: none
  bool map = false;                // one shaper for the whole bed against one optimum per place
  // Tolerances that the print must keep, µm, and whether it must keep them at all times.
  std::vector<double> tolerances_um;
  bool at_all_times = false;
  // Accelerations to compensate the print at, whether the print's own ones are scaled, and the RMS
  // to keep.
  std::vector<double> accels_mm_s2;
  bool scale_m204 = false;
  std::optional<double> keep_rms_um;
};

struct BatchConfig {
  std::optional<std::string> summary;  // a file ending in .json or .xml
  std::string shard_text;              // value of --shard; empty: not given
  std::optional<Shard> shard;          // the part of the folder that is worked on
  bool watch = false;                  // wait for further prints
};

// How windows are solved.
struct SolveConfig {
  flow::EngineChoice engine = flow::EngineChoice::automatic;
  bool check = false;  // --check-solver
  unsigned workers = 1;
};

struct RunConfig {
  Command command = Command::compensate;
  // compensate, inspect: IN; verify: the file given to --against; printer init: --from; study: IN,
  // empty for the thesis' cases; batch: the folder of the prints; tune: the tower that was printed,
  // empty for the first; hotend: the log, empty where there is none; kinematics: IN, empty with
  // --fit
  std::string input;
  std::optional<std::string> input_text;  // of an input that is in no file
  // compensate, printer init, printer macros, printer line-test, batch, tune: -o, or the input with
  // --in-place; verify: OUT
  std::string output;
  TimingMethod timing_method = TimingMethod::as_set;  // value of --timing
  std::string faster_um;                    // value of --faster, of study a list; empty: not given
  std::optional<double> filament_start_mm;  // value of --filament-start-mm
  bool in_place = false;
  std::optional<std::string> printer_file;
  std::vector<std::string> overrides;  // "key=value"
  std::optional<std::string> report;   // a file ending in .json or .html, or "-"; batch: a folder
  std::optional<std::string> log;      // compensate: file to which all messages are added
  // compensate: the print's name in messages, and the printer's settings from the slicer that
  // started the program (hook.hpp)
  std::string print_name;
  machine::SlicerVariables slicer_settings;
  std::optional<double> max_deviation_mm;
  SolveConfig solve;
  bool quiet = false;
  bool all_settings = false;  // inspect: those at their default, too
  bool strict = false;        // compensate, verify, inspect: warnings are errors
  IdentifyConfig identify;
  TuneConfig tune;
  HotendConfig hotend;
  KinematicsConfig kinematics;
  StudyConfig study;
  BatchConfig batch;
};

// The command line understood: either work to do, or a text to print instead (--help, --version).
struct CommandLine {
  std::optional<RunConfig> config;
  std::string text;
};

// Reads the command line, without the program's name. Errors are of kind usage, one line.
[[nodiscard]] Result<CommandLine> parse_command_line(const std::vector<std::string>& arguments);

// Whether a report of that name is a page.
[[nodiscard]] bool is_html(std::string_view report);

[[nodiscard]] std::string_view version();

}  // namespace unflex::app
