#include "unflex/app/run.hpp"

#include <chrono>
#include <cstdlib>
#include <exception>
#include <optional>
#include <string_view>

#include "batch.hpp"
#include "console.hpp"
#include "filament.hpp"
#include "files.hpp"
#include "hook.hpp"
#include "hotend.hpp"
#include "identify.hpp"
#include "inspection.hpp"
#include "kinematics.hpp"
#include "log.hpp"
#include "machines.hpp"
#include "map_study.hpp"
#include "print_run.hpp"
#include "print_work.hpp"
#include "printer_init.hpp"
#include "printer_keys.hpp"
#include "printer_line_test.hpp"
#include "printer_macros.hpp"
#include "results.hpp"
#include "translate.hpp"
#include "tune.hpp"
#include "unflex/core/caught.hpp"
#include "unflex/core/lanes.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/platform/catching.hpp"
#include "unflex/platform/process.hpp"
#include "unflex/platform/signals.hpp"
#include "unflex/report/report.hpp"
#include "unflex/study/accels.hpp"
#include "unflex/study/fastest.hpp"
#include "unflex/study/study.hpp"
#include "unflex/study/study_accels.hpp"
#include "unflex/study/study_fastest.hpp"
#include "unflex/study/study_print.hpp"
#include "workspace.hpp"

namespace unflex::app {
namespace {

Result<ExitCode> run_inspect(const RunConfig& config, Console& console) {
  Result<Workspace> space = open_workspace(config);
  if (!space) {
    return tl::unexpected(space.error());
  }
  Result<flow::Inspection> inspection = work_on_print(config, *space, flow::inspect);
  if (!inspection) {
    return tl::unexpected(inspection.error());
  }
  add_setting_warnings(space->settings, inspection->warnings);
  if (Status accepted = accept(config, inspection->warnings, false, console); !accepted) {
    return tl::unexpected(accepted.error());
  }
  console.warnings(inspection->warnings);
  const std::string json = inspection_json(*inspection, config.input, space->settings);
  const std::string text =
      inspection_text(*inspection, config.input, space->settings, config.all_settings);
  return write_report(space->report, json)
      .and_then([&] { return print_summary(config, text, console); })
      .map([] { return ExitCode::done; });
}

// Runs the study that the command asks for: of the corner, or of a print.
Result<study::Outcome> study_outcome(const RunConfig& config, std::optional<Workspace>& print) {
  const bool traces = config.report && config.report->ends_with(".html");
  if (!print) {
    const study::Options options{.ipopt = config.solve.engine == flow::EngineChoice::ipopt,
                                 .workers = config.solve.workers,
                                 .cases = config.study.cases,
                                 .traces = traces};
    return with_progress(
        config, [&](Progress& progress) { return study::study_corner(options, progress); });
  }
  const Result<flow::Job> job = job_of(config, *print);
  if (!job) {
    return tl::unexpected(job.error());
  }
  Result<study::Outcome> outcome = with_progress(
      config, [&](Progress& progress) { return study::study_print(*job, traces, progress); });
  if (const Status unchanged = check_inputs(*print); !unchanged) {
    return tl::unexpected(unchanged.error());
  }
  if (outcome) {
    outcome->printer = settings_in_force(print->settings);
    add_setting_warnings(print->settings, outcome->warnings);
  }
  return outcome;
}

Result<ExitCode> run_study(const RunConfig& config, Console& console) {
  const auto start = std::chrono::steady_clock::now();
  std::optional<Workspace> print;
  std::optional<Output> report;
  if (!config.input.empty()) {
    Result<Workspace> space = open_workspace(config);
    if (!space) {
      return tl::unexpected(space.error());
    }
    print.emplace(std::move(*space));
  } else if (config.report) {
    Result<Output> opened = Output::open(*config.report);
    if (!opened) {
      return tl::unexpected(opened.error());
    }
    report.emplace(std::move(*opened));
  }
  Result<study::Outcome> outcome = study_outcome(config, print);
  if (!outcome) {
    return tl::unexpected(outcome.error());
  }
  outcome->version = version();
  outcome->wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  console.warnings(outcome->warnings);
  const bool html = config.report && config.report->ends_with(".html");
  return write_report(print ? print->report : report,
                      html ? study::to_html(*outcome) : study::to_json(*outcome))
      .and_then([&] { return print_summary(config, study::to_text(*outcome), console); })
      .map([] { return ExitCode::done; });
}

// A study of a print. `report_of` makes the text of its report.
template <class Study, class Report>
Result<ExitCode> run_print_study(const RunConfig& config, Console& console,
                                 machine::Settings (*settings_for)(machine::Settings),
                                 const Study& work, const Report& report_of) {
  const auto start = std::chrono::steady_clock::now();
  Result<Workspace> space = open_workspace(config);
  if (!space) {
    return tl::unexpected(space.error());
  }
  space->settings = settings_for(std::move(space->settings));
  const Result<flow::Job> job = job_of(config, *space);
  if (!job) {
    return tl::unexpected(job.error());
  }
  auto outcome = with_progress(config, [&](Progress& progress) { return work(*job, progress); });
  if (const Status unchanged = check_inputs(*space); !unchanged) {
    return tl::unexpected(unchanged.error());
  }
  if (!outcome) {
    return tl::unexpected(outcome.error());
  }
  outcome->version = version();
  outcome->printer = settings_in_force(space->settings);
  add_setting_warnings(space->settings, outcome->warnings);
  outcome->wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  console.warnings(outcome->warnings);
  return write_report(space->report, report_of(*outcome))
      .and_then([&] { return print_summary(config, study::to_text(*outcome), console); })
      .map([] { return ExitCode::done; });
}

// study --faster
Result<ExitCode> run_fastest(const RunConfig& config, Console& console) {
  std::vector<double> tolerances_mm;
  for (const double tolerance_um : config.study.tolerances_um) {
    tolerances_mm.push_back(1e-3 * tolerance_um);
  }
  study::ToleranceRule rule;
  rule.largest_times = config.study.at_all_times ? 1.0 : rule.largest_times;
  return run_print_study(
      config, console, study::settings_of_fastest,
      [&](const flow::Job& job, Progress& progress) {
        return study::study_fastest(job, tolerances_mm, rule, progress);
      },
      [&](const study::FastestOutcome& outcome) {
        const std::string_view name = config.report ? *config.report : std::string_view{};
        return is_html(name)            ? study::to_html(outcome)
               : name.ends_with(".svg") ? study::to_svg(outcome)
                                        : study::to_json(outcome);
      });
}

// study --accel
Result<ExitCode> run_accels(const RunConfig& config, Console& console) {
  return run_print_study(
      config, console, [](machine::Settings settings) { return settings; },
      [&](const flow::Job& job, Progress& progress) {
        auto outcome =
            study::study_accels(job, config.study.accels_mm_s2, config.study.scale_m204, progress);
        if (outcome && config.study.keep_rms_um) {
          outcome->keep_rms_mm = 1e-3 * *config.study.keep_rms_um;
        }
        return outcome;
      },
      [](const study::AccelsOutcome& outcome) { return study::to_json(outcome); });
}

Result<ExitCode> run_command(const RunConfig& config, Console& console) {
  switch (config.command) {
    case Command::inspect:
      return run_inspect(config, console);
    case Command::printer_init:
      return run_printer_init(config, console);
    case Command::printer_keys:
      return run_printer_keys();
    case Command::line_test:
      return run_line_test(config, console);
    case Command::printer_macros:
      return run_printer_macros(config);
    case Command::identify:
      return run_identify(config, console);
    case Command::study:
      if (!config.study.tolerances_um.empty()) {
        return run_fastest(config, console);
      }
      if (!config.study.accels_mm_s2.empty()) {
        return run_accels(config, console);
      }
      if (config.study.map) {
        return run_map_study(config, console);
      }
      return config.study.machines.empty() ? run_study(config, console)
                                           : run_machines(config, console);
    case Command::batch:
      return run_batch(config, console);
    case Command::tune:
      return run_tune(config, console);
    case Command::filament:
      return run_filament(config, console);
    case Command::hotend:
      return run_hotend(config, console);
    case Command::kinematics:
      return run_kinematics(config, console);
    case Command::translate:
      return run_translate(config, console);
    case Command::compensate:
    case Command::verify:
      break;
  }
  return run_on_print(config, console);
}

// Runs the command and says what went wrong. Returns the exit code.
int run_said(const RunConfig& config, Console& console) {
  const Result<ExitCode> result = run_command(config, console);
  if (!result) {
    platform::say_last_words_yourself();
    // If a result is in place, the failure itself is told. Otherwise the result would be taken for
    // missing.
    const bool ended = platform::ending_signal() != 0 &&
                       (!platform::has_result() || config.command == Command::batch);
    console.error(ended ? interrupted(config.command).value() : result.error());
    return ended ? kSignalExitBase + platform::ending_signal()
                 : static_cast<int>(exit_code(result.error().kind));
  }
  return static_cast<int>(*result);
}

int refused(const Error& error) {
  Console().error(error);
  return static_cast<int>(exit_code(error.kind));
}

}  // namespace

int run(const RunConfig& asked) {
  platform::catch_signals(error_text(interrupted(asked.command).value()),
                          error_text(interrupted(asked.command, true).value()));
  const Result<RunConfig> config = with_slicer(asked, read_slicer());
  if (!config) {
    return refused(config.error());
  }
  Result<Log> log = Log::open(*config);
  if (!log) {
    return refused(log.error());
  }
  Console console;
  const int code = run_said(*config, console);
  if (const Status logged = log->append(console.kept(), code); !logged) {
    console.error(logged.error());
  }
  return code;
}

// Whether to leave the processor's wide registers unused, to show that they make no difference.
static bool prefers_two_lanes() {
  const char* const lanes = std::getenv("UNFLEX_LANES");
  return lanes != nullptr && std::string_view(lanes) == "2";
}

int run_program(const std::vector<std::string>& arguments) {
  platform::prepare_process();
  prefer_two_lanes(prefers_two_lanes());
  int code = static_cast<int>(ExitCode::internal);
  platform::catching(
      [&] {
        const Result<CommandLine> command_line = parse_command_line(arguments);
        if (!command_line) {
          code = refused(command_line.error());
        } else if (command_line->config) {
          code = run(*command_line->config);
        } else if (write_all(platform::kStandardOutput, command_line->text) == 0) {
          code = static_cast<int>(ExitCode::done);
        }
      },
      // Out of memory, mostly; the temporary files are gone with the stack.
      [](const std::exception& failure) { Console().error(error_of(failure)); });
  return code;
}

}  // namespace unflex::app
