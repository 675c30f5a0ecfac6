#include "calibration_commands.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "command_options.hpp"
#include "unflex/core/number.hpp"

namespace unflex::app {
namespace {

constexpr double kWarmestRoom_c = 150.0;  // the bound of hotend.ambient_c
constexpr double kHottest_c = 1000.0;
constexpr const char* kReportOfModel = "Write a report, FILE.json or FILE.html, or - for stdout";

// Options for a resonance that shows in a print: spacing, speed and decay of its waves.
void add_tower(CLI::App& command, RunConfig& config) {
  // Half the width of the interval in which a value read with a ruler lies, as a share of the
  // value.
  constexpr double kShareOfSpacing = 0.05;
  constexpr double kShareOfDecay = 0.2;
  const auto tower = [&config]() -> identify::Tower& {
    return config.identify.tower ? *config.identify.tower : config.identify.tower.emplace();
  };
  add_number(
      command, "--wave-spacing-mm",
      [tower](double value) {
        tower().spacing_mm = value;
        tower().spacing_spread_mm = kShareOfSpacing * value;
      },
      "Of a ringing tower: distance from wave to wave")
      ->type_name("MM")
      ->check(positive());
  add_number(
      command, "--speed-mm-s", [tower](double value) { tower().speed_mm_s = value; },
      "Of a ringing tower: speed its walls were printed at")
      ->type_name("V")
      ->check(positive());
  add_number(
      command, "--decay",
      [tower](double value) {
        tower().decay = value;
        tower().decay_spread = kShareOfDecay * (value - 1.0);
      },
      "Of a ringing tower: height of a wave over that of the next")
      ->type_name("RATIO")
      ->check(positive());
}

// "x=12..19", or "x=14" for a single band. "pressure=" takes the same two forms.
std::string read_zone(const std::string& text, TuneConfig& tune) {
  const std::size_t equals = std::min(text.find('='), text.size());
  const std::string of = text.substr(0, equals);
  std::optional<tune::Zone>* const zone = of == "x" || of == "X"   ? &tune.zones[0]
                                          : of == "y" || of == "Y" ? &tune.zones[1]
                                          : of == "pressure"       ? &tune.pressure_zone
                                                                   : nullptr;
  const std::string_view bands = std::string_view(text).substr(std::min(equals + 1, text.size()));
  const std::size_t dots = bands.find("..");
  const bool is_range = dots != std::string_view::npos;
  const std::optional<double> first = parse_number(bands.substr(0, dots));
  const std::optional<double> last = is_range ? parse_number(bands.substr(dots + 2)) : first;
  const auto is_band = [](const std::optional<double>& value) {
    constexpr double kMost = 1000.0;
    return value && *value >= 1.0 && *value <= kMost && *value == std::floor(*value);
  };
  if (zone == nullptr || !is_band(first) || !is_band(last)) {
    return fmt::format(
        "'{}' must have the form x=12..19 or pressure=12..19, the first and the last band whose "
        "walls are even",
        text);
  }
  *zone = tune::Zone{static_cast<std::size_t>(*first), static_cast<std::size_t>(*last)};
  return {};
}

}  // namespace

void add_identify(CLI::App& program, RunConfig& config) {
  CLI::App* const command = program.add_subcommand(
      "identify", "Find the resonances in an accelerometer's records or a ringing tower");
  IdentifyConfig& identify = config.identify;
  command
      ->add_option("CSV", identify.records,
                   "Records of Klipper, Shake&Tune or RepRapFirmware, any number of them")
      ->type_name("");
  const CLI::Validator letters =
      word_for<identify::Axis>({{"x", identify::Axis::x}, {"y", identify::Axis::y}});
  command->add_option("--axis", identify.axis, "The axis they are of, if their names do not tell")
      ->type_name("x|y")
      ->transform(letters);
  add_number(*command, "--freq-start", identify.sweep.start_hz,
             "Where the sweep began, 5 by default")
      ->type_name("HZ")
      ->check(positive());
  add_number(*command, "--freq-end", identify.sweep.end_hz, "Where the sweep ended, 133 by default")
      ->type_name("HZ")
      ->check(positive());
  add_tower(*command, config);
  command->add_flag("--second", identify.second,
                    "Find what still rings behind compensated stops; needs --printer");
  command
      ->add_option("--make-test", identify.make_test,
                   "Write G-code with such stops along this axis to -o; needs --printer")
      ->type_name("x|y")
      ->transform(letters);
  command->add_option("-o,--output", config.output, "Where --make-test writes, - for stdout")
      ->type_name("OUT");
  add_common_options(*command, config, kReportOfModel,
                     "Print the lines for the printer file alone");
  command->callback([&config] { config.command = Command::identify; });
}

void add_tune(CLI::App& program, RunConfig& config) {
  CLI::App* const command = program.add_subcommand(
      "tune",
      "Find the resonances or the pressure advance by printing towers and looking at their walls");
  TuneConfig& tune = config.tune;
  command->add_option("TOWER", config.input, "The tower that was printed; without it, the first")
      ->type_name("");
  command
      ->add_option_function<std::vector<std::string>>(
          "--read",
          [&tune](const std::vector<std::string>& zones) {
            for (const std::string& zone : zones) {
              if (const std::string wrong = read_zone(zone, tune); !wrong.empty()) {
                throw CLI::ValidationError("--read", wrong);
              }
            }
          },
          "The bands of TOWER with even walls: x=FIRST..LAST, y=FIRST..LAST, or "
          "pressure=FIRST..LAST; repeatable")
      ->type_name("ZONE")
      ->allow_extra_args(false);
  command->add_flag("--pressure", tune.asks_for_pressure,
                    "The first tower tries pressure advances, not frequencies");
  command->add_option("-o,--output", config.output, "Where to write the next tower, - for stdout")
      ->type_name("OUT");
  command
      ->add_option("--like", tune.like,
                   "A sliced print, whose start code and end code the first tower shall have")
      ->type_name("IN");
  add_number(*command, "--nozzle-temp", tune.nozzle_temp_c,
             "Without --like: the nozzle's temperature, in degrees Celsius")
      ->type_name("C")
      ->check(positive());
  add_number(*command, "--bed-temp", tune.bed_temp_c, "Without --like: the bed's temperature")
      ->type_name("C")
      ->check(positive());
  add_number(*command, "--accel", tune.accel_mm_s2,
             "Acceleration of the tower, in mm/s^2, where the printer's own is too little")
      ->type_name("N")
      ->check(positive());
  add_settings(*command, config);
  command
      ->add_option("--report", config.report,
                   "Write a page, FILE.html, with pictures of the walls to expect")
      ->type_name("FILE");
  add_jobs(*command, config);
  command->add_flag("-q,--quiet", config.quiet, kNoSummary);
  command->callback([&config] { config.command = Command::tune; });
}

void add_hotend(CLI::App& program, RunConfig& config) {
  CLI::App* const command = program.add_subcommand(
      "hotend", "Find the gains that hold the nozzle's temperature, from a log of a heating");
  HotendConfig& hotend = config.hotend;
  command
      ->add_option("LOG", config.input,
                   "klippy.log, a serial log, or a table of time, temperature and power")
      ->type_name("");
  add_number(*command, "--power", hotend.full_power,
             "What means full power in LOG; by default 255 in a table, 1 in klippy.log, 127 "
             "in a serial log")
      ->type_name("FULL")
      ->check(positive());
  command
      ->add_option("--heater", hotend.heater,
                   "The heater's section in printer.cfg, extruder by default")
      ->type_name("NAME");
  add_number(*command, "--ambient", hotend.ambient_c,
             "Temperature of the hotend without power; without it, found in LOG")
      ->type_name("C")
      ->check(temperature(kWarmestRoom_c));
  add_number(*command, "--ku", hotend.ultimate_gain,
             "From a test: the gain at which the temperature keeps swinging, counts of 255 "
             "per degree")
      ->type_name("GAIN")
      ->check(positive());
  add_number(*command, "--pu", hotend.ultimate_period_s, "From a test: the period of that swing")
      ->type_name("S")
      ->check(positive());
  command
      ->add_option("--rule", hotend.rule,
                   "The rule that chooses the gains: simc by default, tl for --ku and --pu")
      ->type_name("simc|simc-pi|zn|zn-pi|cc|tl")
      ->transform(word_for<hotend::Rule>({{"simc", hotend::Rule::simc_pid},
                                          {"simc-pi", hotend::Rule::simc_pi},
                                          {"zn", hotend::Rule::zn_pid},
                                          {"zn-pi", hotend::Rule::zn_pi},
                                          {"cc", hotend::Rule::cohen_coon},
                                          {"tl", hotend::Rule::tyreus_luyben}}));
  add_number(*command, "--target", hotend.target_c, "Where the simulated step goes, 210 by default")
      ->type_name("C")
      ->check(temperature(kHottest_c));
  add_number(*command, "--flow", hotend.flow_mm3_s,
             "Filament that melts, for the simulated load; 10 by default")
      ->type_name("MM3_S")
      ->check(positive());
  add_number(*command, "--heater-watts", hotend.heater_w,
             "What the heater gives at full power, for the load")
      ->type_name("W")
      ->check(positive());
  add_common_options(*command, config, kReportOfModel,
                     "Print the lines to paste alone: the model of LOG, or else the gains");
  command->callback([&config] { config.command = Command::hotend; });
}

void add_kinematics(CLI::App& program, RunConfig& config) {
  CLI::App* const command = program.add_subcommand(
      "kinematics", "Show what a print asks of the joints, or find how they move from places");
  command->add_option("IN", config.input, "G-code, - for stdin")->type_name("");
  command
      ->add_option("--fit", config.kinematics.points,
                   "Instead of IN: measured places, with the columns qa,qb,qc,x,y,z in mm")
      ->type_name("CSV");
  add_settings(*command, config);
  command->add_flag("-q,--quiet", config.quiet,
                    "No summary, of --fit the lines for the printer file alone");
  command->callback([&config] { config.command = Command::kinematics; });
}

}  // namespace unflex::app
