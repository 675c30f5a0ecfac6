#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <iterator>
#include <optional>
#include <string_view>
#include <utility>

#include "calibration_commands.hpp"
#include "command_checks.hpp"
#include "command_options.hpp"
#include "console.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/core/caught.hpp"
#include "unflex/core/number.hpp"
#include "unflex/core/suggestion.hpp"
#include "unflex/core/threads.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/platform/catching.hpp"
#include "unflex/platform/files.hpp"

namespace unflex::app {
namespace {

constexpr double kMostTolerance_um = 1000.0;  // as of timing.tolerance_um

void add_strict(CLI::App& command, RunConfig& config) {
  command.add_flag("--strict", config.strict,
                   "Take warnings for errors: exit code 2, and nothing is written");
}

void add_max_deviation(CLI::App& command, RunConfig& config) {
  add_number(command, "--max-deviation", config.max_deviation_mm,
             "Fail with exit code 3 if extruding moves stray further from the path")
      ->type_name("MM")
      ->check(positive());
}

// Adds a flag whose value stands behind an equals sign only, since the input's name may follow it.
void add_faster(CLI::App& command, RunConfig& config) {
  command
      .add_flag("--faster", config.faster_um,
                "As fast as keeps the nozzle this near the path, 20 by default")
      ->type_name("[=UM]");
}

void add_timing(CLI::App& command, RunConfig& config) {
  command
      .add_option("--timing", config.timing_method,
                  "How --faster finds the timing: scaled, or optimal, a little faster and later")
      ->type_name("scaled|optimal")
      ->transform(word_for<TimingMethod>(
          {{machine::kScaled, TimingMethod::scaled}, {machine::kOptimal, TimingMethod::optimal}}));
}

// --faster and --timing are short for keys.
void take_faster(RunConfig& config) {
  if (config.timing_method != TimingMethod::as_set) {
    const bool is_optimal = config.timing_method == TimingMethod::optimal;
    config.overrides.push_back(
        fmt::format("timing.method={}", is_optimal ? machine::kOptimal : machine::kScaled));
  }
  if (!config.faster_um.empty()) {
    if (parse_number(config.faster_um) == 0.0) {
      throw CLI::ValidationError("--faster",
                                 "a tolerance above 0 µm is needed; without --faster the timing "
                                 "stays as sliced");
    }
    // Without a value a flag is "true".
    config.overrides.push_back("timing.tolerance_um=" +
                               (config.faster_um == "true" ? "20" : config.faster_um));
  }
}

// --filament-start-mm is short for a key.
void take_filament_start(RunConfig& config) {
  if (config.filament_start_mm) {
    config.overrides.push_back(
        fmt::format("extruder.filament_start_mm={}", *config.filament_start_mm));
  }
}

// The tolerances of study --faster.
void take_tolerances(RunConfig& config) {
  if (config.faster_um.empty()) {
    return;
  }
  // Without a value a flag is "true".
  constexpr std::string_view kUsual = "5,10,20,50,100";
  std::string_view rest = config.faster_um;
  if (rest == "true") {
    rest = kUsual;
  }
  for (bool more = true; more;) {
    const std::size_t comma = rest.find(',');
    const std::string_view word = rest.substr(0, comma);
    const std::optional<double> value = parse_number(word);
    if (!value || !std::isfinite(*value) || *value <= 0.0 || *value > kMostTolerance_um) {
      throw CLI::ValidationError(
          "--faster",
          fmt::format("'{}' is not a number above 0, and up to {:g}", word, kMostTolerance_um));
    }
    config.study.tolerances_um.push_back(*value);
    more = comma != std::string_view::npos;
    rest.remove_prefix(more ? comma + 1 : rest.size());
  }
}

void add_engine(CLI::App& command, RunConfig& config, const char* help) {
  command.add_option("--engine", config.solve.engine, help)
      ->type_name("auto|banded|ipopt")
      ->transform(word_for<flow::EngineChoice>({{"auto", flow::EngineChoice::automatic},
                                                {"banded", flow::EngineChoice::banded},
                                                {"ipopt", flow::EngineChoice::ipopt}}));
}

void add_check_solver(CLI::App& command, RunConfig& config) {
  command.add_flag("--check-solver", config.solve.check,
                   "Have a sample solved by Ipopt as well, and warn if it finds something else");
}

void add_print_and_output(CLI::App& command, RunConfig& config) {
  command.add_option("IN", config.input, "Sliced G-code, - for stdin")->type_name("")->required();
  command.add_option("-o,--output", config.output, "Where to write, - for stdout")
      ->type_name("OUT");
  command.add_flag("--in-place", config.in_place, "Replace IN");
}

void add_compensate(CLI::App& program, RunConfig& config) {
  CLI::App* const command = program.add_subcommand(
      "compensate", "Write G-code whose motion makes the nozzle draw the sliced path");
  add_print_and_output(*command, config);
  command
      ->add_option("--log", config.log, "Add what is said and the summary to FILE, with the time")
      ->type_name("FILE");
  add_common_options(*command, config);
  add_strict(*command, config);
  add_faster(*command, config);
  add_timing(*command, config);
  add_max_deviation(*command, config);
  add_engine(*command, config, "What solves: banded, which is also auto, or ipopt");
  add_check_solver(*command, config);
  add_jobs(*command, config);
  command->callback([&config] {
    config.command = Command::compensate;
    take_faster(config);
  });
}

void add_batch(CLI::App& program, RunConfig& config) {
  CLI::App* const command = program.add_subcommand(
      "batch", "Compensate all prints of a folder, those alone that have changed");
  command->add_option("DIR", config.input, "The folder of the prints")->type_name("")->required();
  command->add_option("-o,--output", config.output, "The folder to write to")
      ->type_name("DIR")
      ->required();
  add_settings(*command, config);
  command->add_option("--report", config.report, "A page for each print, in this folder")
      ->type_name("DIR");
  command
      ->add_option("--summary", config.batch.summary,
                   "Write what became of each print, FILE.json, or FILE.xml for JUnit")
      ->type_name("FILE");
  command
      ->add_option("--shard", config.batch.shard_text,
                   "Work on the I-th of N parts, I/N; auto: as Slurm or Kubernetes says")
      ->type_name("I/N");
  command->add_flag("--watch", config.batch.watch, "Go on waiting for further prints");
  command->add_flag("-q,--quiet", config.quiet, "No table and no progress");
  add_faster(*command, config);
  add_timing(*command, config);
  add_max_deviation(*command, config);
  add_engine(*command, config, "What solves: banded, which is also auto, or ipopt");
  add_check_solver(*command, config);
  add_jobs(*command, config);
  command->callback([&config] {
    config.command = Command::batch;
    take_faster(config);
  });
}

void add_verify(CLI::App& program, RunConfig& config) {
  CLI::App* const command = program.add_subcommand(
      "verify", "Measure how far the nozzle strays when a compensated file is printed");
  command->add_option("OUT", config.output, "Compensated G-code, - for stdin")
      ->type_name("")
      ->required();
  command->add_option("--against", config.input, "The sliced G-code it was made from")
      ->type_name("IN")
      ->required();
  add_common_options(*command, config);
  add_strict(*command, config);
  add_faster(*command, config);
  add_max_deviation(*command, config);
  command->callback([&config] {
    config.command = Command::verify;
    take_faster(config);
  });
}

void add_inspect(CLI::App& program, RunConfig& config) {
  CLI::App* const command =
      program.add_subcommand("inspect", "Show what is understood of a G-code file");
  command->add_option("IN", config.input, "G-code, - for stdin")->type_name("")->required();
  add_common_options(*command, config, "Write a report, FILE.json, or to stdout with -");
  add_strict(*command, config);
  command->add_flag("--all", config.all_settings, "List the settings at their default, too");
  command->callback([&config] { config.command = Command::inspect; });
}

void add_filament(CLI::App& program, RunConfig& config) {
  CLI::App* const command = program.add_subcommand(
      "filament", "Fit the E of a print to a filament that is not a full cylinder");
  add_print_and_output(*command, config);
  add_settings(*command, config);
  add_number(*command, "--filament-start-mm", config.filament_start_mm,
             "Where on the filament's profile the print begins")
      ->type_name("MM");
  command->add_flag("-q,--quiet", config.quiet, "No summary");
  add_strict(*command, config);
  command->callback([&config] {
    config.command = Command::filament;
    take_filament_start(config);
  });
}

void add_translate(CLI::App& program, RunConfig& config) {
  CLI::App* const command = program.add_subcommand(
      "translate",
      "Write a print as motion of the joints, for a firmware that knows X, Y, Z alone");
  add_print_and_output(*command, config);
  add_settings(*command, config);
  command->add_flag("-q,--quiet", config.quiet, "No summary and no progress");
  add_strict(*command, config);
  command->callback([&config] { config.command = Command::translate; });
}

void add_study(CLI::App& program, RunConfig& config) {
  CLI::App* const command = program.add_subcommand(
      "study", "Measure all ways to move the base against each other, on a corner or on a print");
  command->add_option("IN", config.input, "G-code, - for stdin; without it the thesis' corner")
      ->type_name("");
  command->add_option("--case", config.study.cases, "Only this case of the corner; repeatable")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command
      ->add_option("--machines", config.study.machines,
                   "With IN: judge unflex and shapers on the machines whose records are in DIR")
      ->type_name("DIR");
  command->add_flag(
      "--map", config.study.map,
      "With IN: the best shaper for the whole bed, and unflex at each place of the maps");
  command
      ->add_flag("--faster", config.faster_um,
                 "With IN: the least print time within contour errors, 5,10,20,50,100 by default")
      ->type_name("[=UM]");
  command->add_flag("--at-all-times", config.study.at_all_times,
                    "With --faster: let no moment exceed it, not even a thousandth");
  command
      ->add_option_function<std::vector<std::string>>(
          "--accel",
          [&config](const std::vector<std::string>& texts) {
            for (const std::string& text : texts) {
              config.study.accels_mm_s2.push_back(number_of("--accel", text));
            }
          },
          "With IN: compensate it at these accelerations, as 2500,5000,10000")
      ->type_name("MM/S2")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(positive());
  command->add_flag("--scale-m204", config.study.scale_m204,
                    "With --accel: scale what the print itself sets of acceleration as well");
  add_number(*command, "--keep-rms", config.study.keep_rms_um,
             "With --accel: name the fastest whose RMS error is at most this")
      ->type_name("UM")
      ->check(positive());
  add_common_options(*command, config);
  add_engine(*command, config, "What solves for unflex: banded (auto), or ipopt");
  add_jobs(*command, config);
  command->callback([&config] {
    config.command = Command::study;
    take_tolerances(config);
  });
}

void add_printer_macros(CLI::App& printer, RunConfig& config) {
  CLI::App* const macros = printer.add_subcommand(
      "macros", "Write Klipper's macros by which a pause waits for the end of a compensated run");
  macros
      ->add_option("-o,--output", config.output,
                   "Where to write, a file that printer.cfg includes, - for stdout")
      ->type_name("OUT")
      ->required();
  add_settings(*macros, config);
  macros->add_flag("-q,--quiet", config.quiet, "No summary");
  macros->callback([&config] { config.command = Command::printer_macros; });
}

void add_printer(CLI::App& program, RunConfig& config) {
  CLI::App* const printer = program.add_subcommand("printer", "Printer files");
  printer->require_subcommand(1);
  CLI::App* const init = printer->add_subcommand(
      "init", "Write a printer file (TOML) from what already describes the printer");
  init->add_option("--from", config.input,
                   "Klipper's printer.cfg, Marlin's M503, RRF's config.g, or a sliced print")
      ->type_name("FILE")
      ->required();
  init->add_option("--record", config.identify.records,
                   "Record of a resonance, as identify takes it; repeatable")
      ->type_name("CSV")
      ->allow_extra_args(false);
  init->add_option("-o,--output", config.output, "Where to write, - for stdout")
      ->type_name("OUT")
      ->required();
  add_overrides(*init, config);
  init->add_flag("-q,--quiet", config.quiet, "No summary");
  init->callback([&config] { config.command = Command::printer_init; });
  CLI::App* const lines = printer->add_subcommand(
      "line-test", "Write G-code that makes the printer show how many lines per second it takes");
  lines->add_option("-o,--output", config.output, "Where to write, - for stdout")
      ->type_name("OUT")
      ->required();
  add_settings(*lines, config);
  lines->add_flag("-q,--quiet", config.quiet, "No summary");
  lines->callback([&config] { config.command = Command::line_test; });
  add_printer_macros(*printer, config);
  CLI::App* const keys = printer->add_subcommand(
      "keys", "List the keys that a printer file and --set take, and what each may be");
  keys->callback([&config] { config.command = Command::printer_keys; });
}

// The chosen command: its words as the help shows them, and its object in CLI11.
struct Chosen {
  std::string words = "unflex";
  const CLI::App* app;
};

Chosen chosen_of(const CLI::App& program) {
  Chosen chosen{.app = &program};
  for (;;) {
    const std::vector<const CLI::App*> below =
        chosen.app->get_subcommands([](const CLI::App* command) { return command->parsed(); });
    if (below.empty()) {
      return chosen;
    }
    chosen.app = below.front();
    chosen.words += " " + chosen.app->get_name();
  }
}

// "unknown option '--ouput', did you mean '--output'?", or nothing if no such option was given.
std::optional<std::string> unknown_option(const CLI::App& command) {
  for (const std::string& word : command.remaining()) {
    if (word == "--") {
      break;
    }
    if (word.size() < 2 || word.front() != '-') {
      continue;
    }
    const std::string name = word.substr(0, word.find('='));
    std::vector<std::string> known;
    for (const CLI::Option* option : command.get_options()) {
      for (const std::string& long_name : option->get_lnames()) {
        known.push_back("--" + long_name);
      }
    }
    // A single letter is near every other.
    return fmt::format(
        "unknown option '{}'{}", one_line(name),
        name.size() > 2 ? suggestion(name, {known.begin(), known.end()}) : std::string{});
  }
  return std::nullopt;
}

// The library's messages start with a capital and may have several lines. For a misspelt option the
// library reports an unexpected argument, or a missing option.
std::string parser_message(const CLI::App& program, const CLI::Error& error) {
  const Chosen chosen = chosen_of(program);
  std::string message = one_line(error.what());
  const auto is_lower = [](char c) { return c >= 'a' && c <= 'z'; };
  if (message.size() > 1 && (is_lower(message[1]) || message[1] == ' ')) {
    message.front() = static_cast<char>(std::tolower(static_cast<unsigned char>(message.front())));
  }
  message = unknown_option(*chosen.app).value_or(message);
  return fmt::format("{}{} run '{} --help'", message, message.ends_with('?') ? "" : ";",
                     chosen.words);
}

// The program's answer to an exception that the library has thrown while it read the arguments.
Result<CommandLine> answer_to(const std::exception& thrown, const CLI::App& program) {
  if (dynamic_cast<const CLI::CallForHelp*>(&thrown) != nullptr) {
    return CommandLine{std::nullopt, program.help()};
  }
  if (dynamic_cast<const CLI::CallForVersion*>(&thrown) != nullptr) {
    return CommandLine{std::nullopt, fmt::format("{}\n", thrown.what())};
  }
  const auto* const error = dynamic_cast<const CLI::Error*>(&thrown);
  return error != nullptr ? fail(ErrorKind::usage, parser_message(program, *error))
                          : tl::unexpected(error_of(thrown));
}

// Arguments that the library would take for a missing value or for the input's name.
Status check_values(const std::vector<std::string>& arguments) {
  for (auto word = arguments.begin(); word != arguments.end(); ++word) {
    if (word->starts_with("--") && word->ends_with('=') && word->find('=') + 1 == word->size()) {
      return fail(ErrorKind::usage, fmt::format("{0} has no value; write it right behind, as in "
                                                "{0}VALUE",
                                                one_line(*word)));
    }
    const bool is_last = word + 1 == arguments.end();
    if (*word == "--faster" && !is_last && parse_number(word[1]) && !platform::exists(word[1])) {
      return fail(ErrorKind::usage,
                  fmt::format("--faster takes its tolerance behind an equals sign: --faster={}",
                              one_line(word[1])));
    }
  }
  return {};
}

// The library would call an unknown command an unexpected argument, or a missing command.
Status check_command(const CLI::App& program, const std::vector<std::string>& arguments) {
  const CLI::App* above = &program;
  for (const std::string& word : arguments) {
    const std::vector<const CLI::App*> commands =
        above->get_subcommands([](const CLI::App*) { return true; });
    if (commands.empty() || word.starts_with("-")) {
      return {};
    }
    const auto found = std::ranges::find(commands, word, &CLI::App::get_name);
    if (found == commands.end()) {
      std::vector<std::string> names;
      std::ranges::transform(commands, std::back_inserter(names), &CLI::App::get_name);
      const std::string near = suggestion(word, {names.begin(), names.end()});
      return fail(ErrorKind::usage,
                  fmt::format("unknown command '{}'{} there are {}", one_line(word),
                              near.empty() ? ";" : near, fmt::join(names, ", ")));
    }
    above = *found;
  }
  return {};
}

}  // namespace

bool is_html(std::string_view report) { return report.ends_with(".html"); }

std::string_view version() { return UNFLEX_VERSION; }

Result<CommandLine> parse_command_line(const std::vector<std::string>& arguments) {
  RunConfig config;
  config.solve.workers = std::clamp(processors(), 1U, kMaxWorkers);
  CLI::App program("Takes the flex out of a 3D printer: pre-compensated G-code from sliced G-code",
                   "unflex");
  program.set_version_flag("--version", fmt::format("unflex {}", version()));
  program.require_subcommand(1);
  // Options are the same on every system; commands added below do as this.
  program.allow_windows_style_options(false);
  add_compensate(program, config);
  add_batch(program, config);
  add_verify(program, config);
  add_inspect(program, config);
  add_filament(program, config);
  add_printer(program, config);
  add_identify(program, config);
  add_tune(program, config);
  add_hotend(program, config);
  add_kinematics(program, config);
  add_translate(program, config);
  add_study(program, config);
  program.footer(
      "Exit codes: 0 done, 1 usage or configuration, 2 bad input, 3 deviation above\n"
      "--max-deviation or a rule broken, 4 internal. More: docs/cli.md");
  if (Status known = check_command(program, arguments); !known) {
    return tl::unexpected(known.error());
  }
  if (Status values = check_values(arguments); !values) {
    return tl::unexpected(values.error());
  }
  // Set only if the library throws. The exception is then its answer.
  std::optional<Result<CommandLine>> answer;
  platform::catching(
      [&] { program.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend())); },
      [&](const std::exception& thrown) { answer = answer_to(thrown, program); });
  if (answer) {
    return std::move(*answer);
  }
  if (Status completed = complete(config); !completed) {
    return tl::unexpected(completed.error());
  }
  return CommandLine{std::move(config), {}};
}

}  // namespace unflex::app
