#include "unflex/app/run.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <exception>
#include <optional>

#include "console.hpp"
#include "identify.hpp"
#include "inputs.hpp"
#include "inspection.hpp"
#include "outputs.hpp"
#include "printer_init.hpp"
#include "progress.hpp"
#include "signals.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/machine/recommend.hpp"
#include "unflex/pipeline/pipeline.hpp"
#include "unflex/pipeline/study_print.hpp"
#include "unflex/report/report.hpp"
#include "unflex/study/study.hpp"

namespace unflex::app {
namespace {

constexpr int kSignalExitBase = 128;

ExitCode exit_code(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage:
      return ExitCode::usage;
    case ErrorKind::input:
      return ExitCode::input;
    case ErrorKind::internal:
      return ExitCode::internal;
  }
  return ExitCode::internal;
}

tl::unexpected<Error> interrupted() {
  return fail(ErrorKind::internal, "interrupted, no file was written");
}

// Two names for one file would have the result destroy what it was made from.
Status check_distinct(const RunConfig& config) {
  const std::string& report = config.report.value_or(std::string(kStandardStream));
  const auto clash = [](const std::string& a, const std::string& b) {
    return a != kStandardStream && b != kStandardStream && same_file(a, b);
  };
  if (config.command == Command::compensate && !config.in_place &&
      clash(config.output, config.input)) {
    return fail(ErrorKind::usage, {config.output, 0},
                "is the input too; to replace it give --in-place");
  }
  if (config.command == Command::compensate && config.printer_file) {
    const std::string& target = config.in_place ? config.input : config.output;
    if (clash(target, *config.printer_file)) {
      return fail(ErrorKind::usage, {target, 0},
                  "is the printer file too; give the output a name of its own");
    }
  }
  for (const std::string& other :
       {config.input, config.output, config.printer_file.value_or(std::string(kStandardStream))}) {
    if (!other.empty() && clash(report, other)) {
      return fail(ErrorKind::usage, {report, 0},
                  "is read or written already; give the report a name of its own");
    }
  }
  return {};
}

// Everything a command works with, opened and checked before the long work begins.
struct Workspace {
  machine::Settings settings;
  Input input;
  std::optional<Input> compensated;  // verify
  std::optional<Output> output;      // compensate
  std::optional<Output> report;
};

Status open_outputs(const RunConfig& config, Workspace& space) {
  if (config.command == Command::compensate) {
    Result<Output> output = Output::open(config.output);
    if (!output) {
      return tl::unexpected(output.error());
    }
    space.output.emplace(std::move(*output));
  }
  if (config.report) {
    Result<Output> report = Output::open(*config.report);
    if (!report) {
      return tl::unexpected(report.error());
    }
    space.report.emplace(std::move(*report));
  }
  return {};
}

// What is read more than once.
Status spool(const RunConfig& config, Workspace& space) {
  if (config.command == Command::compensate) {
    return {};
  }
  if (Status copied = space.input.make_seekable(); !copied) {
    return copied;
  }
  return space.compensated ? space.compensated->make_seekable() : Status{};
}

// Of the print that is read, not of what was made from it.
Result<machine::Settings> load_settings(const RunConfig& config, Input& input) {
  const Result<machine::PrintText> print = input.look();
  if (!print) {
    return tl::unexpected(print.error());
  }
  return machine::load(
      {.print = &*print, .printer_file = config.printer_file, .overrides = config.overrides});
}

Result<Workspace> prepare(const RunConfig& config) {
  Result<Input> input = Input::open(config.input);
  if (!input) {
    return tl::unexpected(input.error());
  }
  Workspace space{{}, std::move(*input), {}, {}, {}};
  if (config.command == Command::verify) {
    Result<Input> compensated = Input::open(config.output);
    if (!compensated) {
      return tl::unexpected(compensated.error());
    }
    space.compensated.emplace(std::move(*compensated));
  }
  const Status ready =
      check_distinct(config)
          .and_then([&] { return open_outputs(config, space); })
          .and_then([&] { return spool(config, space); })
          .and_then([&] { return load_settings(config, space.input); })
          .map([&](machine::Settings settings) { space.settings = std::move(settings); });
  if (!ready) {
    return tl::unexpected(ready.error());
  }
  return space;
}

Result<pipeline::Job> job_of(const RunConfig& config, Workspace& space) {
  pipeline::Job job;
  job.input = space.input.path();
  job.input_name = space.input.name();
  job.output_name = config.output;
  if (space.output) {
    job.output = space.output->path();
    const Result<int> stream = space.output->stream_fd();
    if (!stream) {
      return tl::unexpected(stream.error());
    }
    job.output_fd = *stream;
    job.input_fd = space.input.stream_fd();
    job.input_head = space.input.head();
  } else if (space.compensated) {
    job.output = space.compensated->path();
  }
  job.settings = space.settings;
  job.engine = config.engine;
  job.workers = config.workers;
  job.record = config.report && is_html(*config.report);
  return job;
}

// Runs one of the pipeline's commands with a progress bar that is gone when it returns.
template <class Work>
auto with_progress(const RunConfig& config, Work work)
    -> decltype(work(std::declval<Progress&>())) {
  const std::unique_ptr<Progress> progress = make_progress(config.quiet);
  auto result = work(*progress);
  if (ending_signal() != 0) {
    return interrupted();
  }
  return result;
}

std::vector<std::string> setting_warnings(const machine::Settings& settings) {
  std::vector<std::string> remarks;
  for (const Diagnostic& note : settings.notes) {
    remarks.push_back(to_string(note));
  }
  for (const std::string& remark : machine::recommendations(settings)) {
    remarks.push_back(fmt::format("unflex: warning: {}", remark));
  }
  return remarks;
}

// Remarks about the settings come before those about the print.
void add_setting_warnings(const machine::Settings& settings, std::vector<std::string>& warnings) {
  const std::vector<std::string> remarks = setting_warnings(settings);
  warnings.insert(warnings.begin(), remarks.begin(), remarks.end());
}

void print_warnings(const std::vector<std::string>& warnings) {
  print_lines(warnings, warnings.size(), "warnings");
}

// Whether --strict ends the work here; the warnings are then shown as the errors they are.
bool ends_strictly(const RunConfig& config, std::vector<std::string> warnings) {
  if (!config.strict || warnings.empty()) {
    return false;
  }
  constexpr std::string_view kWarning = ": warning: ";
  for (std::string& warning : warnings) {
    if (const std::size_t at = warning.find(kWarning); at != std::string::npos) {
      warning.replace(at, kWarning.size(), ": ");
    }
  }
  print_lines(warnings, warnings.size(), "errors");
  return true;
}

// The summary goes to stdout, unless a result is there; then to stderr if someone is looking.
Status print_summary(const RunConfig& config, std::string_view text) {
  if (config.quiet) {
    return {};
  }
  const bool stdout_taken =
      config.report == kStandardStream ||
      (config.command == Command::compensate && config.output == kStandardStream);
  if (stdout_taken) {
    if (::isatty(STDERR_FILENO) == 1) {
      static_cast<void>(write_all(STDERR_FILENO, text));
    }
    return {};
  }
  const int error = write_all(STDOUT_FILENO, text);
  return error == 0 ? Status{}
                    : Status(fail(ErrorKind::internal, {"stdout", 0},
                                  fmt::format("cannot write: {}", errno_text(error))));
}

Status write_report(std::optional<Output>& report, std::string_view text) {
  if (!report) {
    return {};
  }
  if (Status written = report->write(text); !written) {
    return written;
  }
  return report->commit();
}

// What the results say about success: broken rules before deviation. passed_on: the output has gone
// to a stream as it came.
ExitCode judge(const RunConfig& config, bool passed_on, const report::Report& report) {
  const std::string_view consequence =
      passed_on ? "what was passed on must not be printed" : "nothing was written";

  print_lines(report.violations, report.violation_count, "violations");
  if (report.violation_count > 0 && config.command == Command::compensate) {
    print_line(fmt::format("unflex: the result breaks rules, which is a fault of unflex; {}",
                           consequence));
    return ExitCode::internal;
  }
  if (report.violation_count > 0) {
    return ExitCode::deviation;
  }
  const double deviation_mm = report.compensated.extruding.contour_max_mm;
  if (config.max_deviation_mm && !(deviation_mm <= *config.max_deviation_mm)) {
    print_line(
        fmt::format("{}: extruding moves stray up to {:.4g} mm, more than --max-deviation {}{}",
                    config.output, deviation_mm, *config.max_deviation_mm,
                    config.command == Command::compensate ? fmt::format("; {}", consequence) : ""));
    return ExitCode::deviation;
  }
  return ExitCode::done;
}

// An output that failed is not handed on, but what is known about it is.
Status deliver(const RunConfig& config, Workspace& space, ExitCode verdict, bool passed_on,
               const report::Report& report) {
  if (space.output && verdict == ExitCode::done && !passed_on) {
    if (Status committed = space.output->commit(); !committed) {
      return committed;
    }
  }
  const std::string text = report.recording ? report::to_html(report) : report::to_json(report);
  return write_report(space.report, text).and_then([&] {
    return print_summary(config, report::to_text(report));
  });
}

Result<ExitCode> run_on_prints(const RunConfig& config) {
  Result<Workspace> space = prepare(config);
  if (!space) {
    return tl::unexpected(space.error());
  }
  if (ends_strictly(config, setting_warnings(space->settings))) {
    return ExitCode::input;
  }
  const Result<pipeline::Job> job = job_of(config, *space);
  if (!job) {
    return tl::unexpected(job.error());
  }
  Result<report::Report> report = with_progress(config, [&](Progress& progress) {
    return config.command == Command::compensate ? pipeline::compensate(*job, progress)
                                                 : pipeline::verify(*job, progress);
  });
  if (!report) {
    return tl::unexpected(report.error());
  }
  if (ends_strictly(config, report->warnings)) {
    return ExitCode::input;
  }
  add_setting_warnings(space->settings, report->warnings);
  print_warnings(report->warnings);
  const ExitCode verdict = judge(config, job->output_fd >= 0, *report);
  return deliver(config, *space, verdict, job->output_fd >= 0, *report).map([&] {
    return verdict;
  });
}

Result<ExitCode> run_inspect(const RunConfig& config) {
  Result<Workspace> space = prepare(config);
  if (!space) {
    return tl::unexpected(space.error());
  }
  const Result<pipeline::Job> job = job_of(config, *space);
  if (!job) {
    return tl::unexpected(job.error());
  }
  Result<pipeline::Inspection> inspection =
      with_progress(config, [&](Progress& progress) { return pipeline::inspect(*job, progress); });
  if (!inspection) {
    return tl::unexpected(inspection.error());
  }
  add_setting_warnings(space->settings, inspection->warnings);
  if (ends_strictly(config, inspection->warnings)) {
    return ExitCode::input;
  }
  print_warnings(inspection->warnings);
  const std::string json = inspection_json(*inspection, config.input, space->settings);
  const std::string text = inspection_text(*inspection, config.input, space->settings);
  return write_report(space->report, json)
      .and_then([&] { return print_summary(config, text); })
      .map([] { return ExitCode::done; });
}

// What the command studies: the corner, or a print.
Result<study::Outcome> study_outcome(const RunConfig& config, std::optional<Workspace>& print) {
  const bool traces = config.report && config.report->ends_with(".html");
  if (!print) {
    const study::Options options{.ipopt = config.engine == pipeline::EngineChoice::ipopt,
                                 .workers = config.workers,
                                 .cases = config.cases,
                                 .traces = traces};
    return with_progress(
        config, [&](Progress& progress) { return study::study_corner(options, progress); });
  }
  const Result<pipeline::Job> job = job_of(config, *print);
  if (!job) {
    return tl::unexpected(job.error());
  }
  Result<study::Outcome> outcome = with_progress(
      config, [&](Progress& progress) { return pipeline::study_print(*job, traces, progress); });
  if (outcome) {
    outcome->printer = settings_in_force(print->settings);
    add_setting_warnings(print->settings, outcome->warnings);
  }
  return outcome;
}

Result<ExitCode> run_study(const RunConfig& config) {
  const auto start = std::chrono::steady_clock::now();
  std::optional<Workspace> print;
  std::optional<Output> report;
  if (!config.input.empty()) {
    Result<Workspace> space = prepare(config);
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
  print_warnings(outcome->warnings);
  const bool html = config.report && config.report->ends_with(".html");
  return write_report(print ? print->report : report,
                      html ? study::to_html(*outcome) : study::to_json(*outcome))
      .and_then([&] { return print_summary(config, study::to_text(*outcome)); })
      .map([] { return ExitCode::done; });
}

// A descriptor 0, 1 or 2 that was closed would be given to the next file opened, and messages
// would land in it. /dev/null is opened the wrong way round, so that using it is still an error.
void reserve_standard_descriptors() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) < 0) {
      static_cast<void>(::open("/dev/null", fd == STDIN_FILENO ? O_WRONLY : O_RDONLY));
    }
  }
}

Result<ExitCode> run_command(const RunConfig& config) {
  switch (config.command) {
    case Command::inspect:
      return run_inspect(config);
    case Command::printer_init:
      return run_printer_init(config);
    case Command::identify:
      return run_identify(config);
    case Command::study:
      return run_study(config);
    case Command::compensate:
    case Command::verify:
      break;
  }
  return run_on_prints(config);
}

}  // namespace

int run(const RunConfig& config) {
  catch_signals();
  const Result<ExitCode> result = run_command(config);
  if (!result) {
    const bool ended = ending_signal() != 0;
    print_error(ended ? interrupted().value() : result.error());
    return ended ? kSignalExitBase + ending_signal()
                 : static_cast<int>(exit_code(result.error().kind));
  }
  return static_cast<int>(*result);
}

int run_program(const std::vector<std::string>& arguments) {
  reserve_standard_descriptors();
  try {
    const Result<CommandLine> command_line = parse_command_line(arguments);
    if (!command_line) {
      print_error(command_line.error());
      return static_cast<int>(exit_code(command_line.error().kind));
    }
    if (command_line->config) {
      return run(*command_line->config);
    }
    const int error = write_all(STDOUT_FILENO, command_line->text);
    return static_cast<int>(error == 0 ? ExitCode::done : ExitCode::internal);
  } catch (const std::exception& failure) {
    // Out of memory, mostly; the temporary files are gone with the stack.
    print_line(fmt::format("unflex: internal error: {}", failure.what()));
    return static_cast<int>(ExitCode::internal);
  }
}

}  // namespace unflex::app
