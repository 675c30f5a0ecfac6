#include "print_run.hpp"

#include <fmt/core.h>

#include <string>
#include <string_view>
#include <utility>

#include "results.hpp"
#include "workspace.hpp"

namespace unflex::app {
namespace {

// The exit code that follows from the results: broken rules count before deviation.
ExitCode exit_code_of(const RunConfig& config, bool passed_on, const report::Report& report,
                      Console& console) {
  const std::string_view consequence = consequence_of(passed_on);

  console.lines(
      report.violations, report.violation_count,
      report.violation_count > report.violations.size()
          ? fmt::format("violations; --report lists the first {}", report.violations.size())
          : "violations; --report lists them");
  if (report.violation_count > 0 && config.command == Command::compensate) {
    console.line(fmt::format("unflex: the result breaks rules, which is a fault of unflex; {}",
                             consequence));
    return ExitCode::internal;
  }
  if (report.violation_count > 0) {
    return ExitCode::deviation;
  }
  const double deviation_mm = report.measured.compensated.extruding.contour_max_mm;
  if (config.max_deviation_mm && !(deviation_mm <= *config.max_deviation_mm)) {
    console.line(
        fmt::format("{}: extruding moves stray up to {:.6g} mm, more than --max-deviation {}{}",
                    config.command == Command::compensate ? config.print_name : config.output,
                    deviation_mm, *config.max_deviation_mm,
                    config.command == Command::compensate ? fmt::format("; {}", consequence) : ""));
    return ExitCode::deviation;
  }
  return ExitCode::done;
}

// Delivers both output and report, or none: if there is no room for the report, the output must not
// be there either. The inputs are checked as late as possible, since a print that is replaced must
// still be the one that was read.
Status deliver_output(Workspace& space, std::string_view report) {
  const auto commit_report = [&](bool to_stream) {
    return space.report && space.report->is_stream() == to_stream ? space.report->commit()
                                                                  : Status{};
  };
  return space.output->seal()
      .and_then([&] { return space.report ? space.report->write(report) : Status{}; })
      .and_then([&] { return space.report ? space.report->seal() : Status{}; })
      .and_then([&] { return check_inputs(space); })
      // Only writing tells whether a stream takes the report, so this comes before the output.
      .and_then([&] { return commit_report(true); })
      .and_then([&] { return space.output->commit(); })
      .and_then([&] { return commit_report(false); });
}

// An output that failed is not delivered, but the report on it is.
Status deliver(const RunConfig& config, Workspace& space, ExitCode verdict, bool passed_on,
               const report::Report& report) {
  const std::string text = !space.report             ? std::string()
                           : is_html(*config.report) ? report::to_html(report)
                                                     : report::to_json(report);
  if (passed_on) {
    platform::note_result();
  }
  const bool wanted = space.output && verdict == ExitCode::done && !passed_on;
  return wanted ? deliver_output(space, text) : write_report(space.report, text);
}

void note_filament(const Workspace& space, report::Report& report) {
  if (!space.fitted) {
    return;
  }
  const filament::Totals& totals = space.fitted->totals;
  report.fitted_filament = {totals.sliced_mm, totals.fitted_mm, totals.material_mm3,
                            totals.least,     totals.most,      totals.end_mm};
  report.warnings.insert(report.warnings.begin(), space.fitted->warnings.begin(),
                         space.fitted->warnings.end());
}

}  // namespace

Result<PrintOutcome> work_on_print(const RunConfig& config, Console& console) {
  Result<Workspace> space = open_workspace(config);
  if (!space) {
    return tl::unexpected(space.error());
  }
  if (Status accepted = accept(config, setting_warnings(space->settings), false, console);
      !accepted) {
    return tl::unexpected(accepted.error());
  }
  const Result<flow::Job> job = job_of(config, *space);
  if (!job) {
    return tl::unexpected(job.error());
  }
  const bool passed_on = job->output_stream != nullptr;
  Result<report::Report> report = with_progress(config, [&](Progress& progress) {
    return config.command == Command::compensate ? flow::compensate(*job, progress)
                                                 : flow::verify(*job, progress);
  });
  if (const Status unchanged = check_inputs(*space); !unchanged) {
    return tl::unexpected(unchanged.error());
  }
  if (!report) {
    return tl::unexpected(report.error());
  }
  note_filament(*space, *report);
  if (Status accepted = accept(config, report->warnings, passed_on, console); !accepted) {
    return tl::unexpected(accepted.error());
  }
  add_setting_warnings(space->settings, report->warnings);
  console.warnings(report->warnings);
  const ExitCode verdict = exit_code_of(config, passed_on, *report, console);
  return deliver(config, *space, verdict, passed_on, *report).map([&] {
    return PrintOutcome{verdict, std::move(*report)};
  });
}

Result<ExitCode> run_on_print(const RunConfig& config, Console& console) {
  const Result<PrintOutcome> outcome = work_on_print(config, console);
  if (!outcome) {
    return tl::unexpected(outcome.error());
  }
  return print_summary(config, report::to_text(outcome->report), console).map([&] {
    return outcome->verdict;
  });
}

}  // namespace unflex::app
