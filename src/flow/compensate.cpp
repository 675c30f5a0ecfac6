#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <istream>
#include <iterator>
#include <memory>
#include <ostream>
#include <utility>
#include <vector>

#include "compensate_pass.hpp"
#include "report_rows.hpp"
#include "retime.hpp"
#include "stream_buffers.hpp"
#include "unflex/core/errno_text.hpp"
#include "unflex/core/rewrite_lines.hpp"
#include "unflex/machine/mode_frame.hpp"
#include "unflex/report/format.hpp"
#include "unflex/run/extruded_path.hpp"
#include "unflex/temperature/temperature.hpp"

namespace unflex::flow {
namespace {

// Most passes over one print. Each pass keeps the runs that broke rules in the passes before.
constexpr int kMostPasses = 5;

Engines engines_of(const Job& job) {
  if (job.engine == EngineChoice::ipopt) {
    return {nullptr, compensate::make_ipopt_engine};
  }
  return {compensate::make_banded_engine,
          job.check_solver ? compensate::make_ipopt_engine : nullptr};
}

std::string name_of(const Engines& engines) {
  if (!engines.threaded) {
    return engines.second()->name();
  }
  const std::string name = engines.threaded()->name();
  return engines.second ? fmt::format("{}, checked by {}", name, engines.second()->name()) : name;
}

PassOutcome failed(tl::unexpected<Error> error) { return {std::move(error)}; }

// Opens what the job names and goes over it once.
PassOutcome pass(const Job& job, const Engines& engines, const std::vector<verify::BlamedRun>& kept,
                 bool last, Progress& progress, report::Report& report) {
  // This forks, so it comes before any thread exists.
  Result<WorkerPool> processes =
      WorkerPool::start(engines.threaded ? (engines.second ? 1 : 0) : job.workers, engines.second);
  if (!processes) {
    return failed(tl::unexpected(processes.error()));
  }
  CpuSlots slots(job.workers);
  SourceBuffer source(job, progress, slots);
  SinkBuffer sink(job, progress, slots);
  std::istream in_stream(&source);
  std::ostream out_stream(&sink);
  source.set_stream(in_stream);
  const std::unique_ptr<std::istream> in_text = job.input_stream ? nullptr : job.input->read();
  const std::unique_ptr<std::ostream> out_text = job.output_stream ? nullptr : job.output->write();
  if (in_text && !*in_text) {
    return failed(fail(ErrorKind::input, {job.input_name, 0}, "cannot read the file"));
  }
  if (out_text && !*out_text) {
    return failed(fail(ErrorKind::internal, {job.output_name, 0}, "cannot write the output"));
  }
  std::istream& input = in_text ? *in_text : in_stream;
  std::ostream& output = out_text ? *out_text : out_stream;
  PassOutcome outcome = compensate_pass(
      job, engines, kept, {input, output, *processes, slots, [&] { source.stop(); }, last},
      progress, report);
  const bool is_whole = !outcome.status || sink.finish();
  if (sink.error() != 0) {
    return failed(fail(ErrorKind::internal,
                       {job.output_name == "-" ? "stdout" : job.output_name, 0},
                       fmt::format("cannot write: {}", write_error_text(sink.error()))));
  }
  if (!outcome.status) {
    outcome.status = tl::unexpected(source.error().value_or(outcome.status.error()));
    return outcome;
  }
  if (!is_whole) {
    return failed(fail(ErrorKind::internal, "cancelled"));
  }
  output.flush();
  if (!output) {
    return failed(output_failed(job.output_name));
  }
  return outcome;
}

// The report lists single runs that were kept. If all were kept, warn the user.
bool warn_of_no_run(const Job& job, report::Report& report) {
  if (report.runs.total == 0 || report.runs.compensated > 0 || report.runs.fallbacks.empty()) {
    return false;
  }
  const report::Fallback& first = report.runs.fallbacks.front();
  report.warnings.push_back(to_string(Diagnostic{
      {job.input_name, first.first_line},
      fmt::format("nothing is compensated: {} as sliced, this one since {}",
                  report.runs.total == 1 ? "its only run stays"
                                         : fmt::format("all {} runs stay", report.runs.total),
                  first.reason)}));
  return true;
}

// Runs that stay as sliced are played without the printer's own shaper. With many of them the whole
// print may be worse than the sliced file.
void warn_of_no_gain(const Job& job, report::Report& report) {
  constexpr double kWorse = 1.05;
  constexpr double kWorse_mm = 2e-4;
  if (report::keeps_tolerance(report)) {
    return;  // faster, and as exact as asked
  }
  const double now_mm = report.measured.uncompensated.extruding.contour_rms_mm;
  const double compensated_mm = report.measured.compensated.extruding.contour_rms_mm;
  if (compensated_mm <= kWorse * now_mm + kWorse_mm) {
    return;
  }
  report.warnings.push_back(to_string(Diagnostic{
      {job.input_name, 0},
      fmt::format("the nozzle would stray further from the path than now, {} instead of {} µm RMS: "
                  "print the sliced file, or mend what keeps its motion as sliced",
                  report::micrometres_text(compensated_mm), report::micrometres_text(now_mm))}));
}

// Both engines find the optimum of the same program. If they differ, one of them is wrong.
void warn_of_gap(const Job& job, report::Report& report) {
  constexpr double kMostGap = 1e-5;
  constexpr double kMost_mm = 5e-4;
  const report::SolverCheck& check = report.solver.check;
  if (check.largest_gap <= kMostGap && check.largest_difference_mm <= kMost_mm) {
    return;
  }
  report.warnings.push_back(to_string(Diagnostic{
      {job.input_name, 0},
      fmt::format(
          "the solver and Ipopt do not find the same motion: their costs differ by {:.2g} %, "
          "the base by {} µm; do not print this, use --engine ipopt, and report it with the "
          "print and the printer file",
          100.0 * check.largest_gap, report::micrometres_text(check.largest_difference_mm))}));
}

// A stream has gone by before its later lines are known, so its hotend is not followed.
Status follow_hotend(const Job& job, Progress& progress, report::Report& report) {
  if (!job.input_stream && !job.output_stream) {
    return temperature::follow_temperature(job, temperature::OutputMay::change, progress, report);
  }
  if (job.settings.hotend.ahead) {
    report.warnings.push_back(to_string(
        Diagnostic{{job.input_name, 0},
                   "hotend.ahead does nothing in a stream; give a file to read and one to write"}));
  }
  return {};
}

// Whether the output can be written once more.
bool can_repeat(const Job& job) { return !job.input_stream && !job.output_stream; }

}  // namespace

Status check_built(EngineChoice engine) {
  if (engine == EngineChoice::ipopt && !compensate::has_ipopt_engine()) {
    return fail(ErrorKind::usage, "Ipopt is not built into this unflex; the banded engine solves");
  }
  return {};
}

namespace {

// Ipopt's processes get the windows of X and Y alone.
Status check_modes(const Job& job) {
  const std::optional<dynamics::ModeFrame> frame = machine::mode_frame(job.settings);
  if (job.engine == EngineChoice::ipopt && frame && frame->mode(2)) {
    return fail(ErrorKind::usage,
                "--engine ipopt solves X and Y alone, but this machine's modes move the nozzle in "
                "Z; take the banded engine");
  }
  return {};
}

}  // namespace

Result<report::Report> compensate(const Job& job, Progress& progress) {
  if (const std::optional<Diagnostic>& refusal = job.settings.refusal) {
    return fail(ErrorKind::usage, refusal->place, refusal->message);
  }
  return check_built(job.check_solver ? EngineChoice::ipopt : job.engine)
      .and_then([&] { return check_modes(job); })
      .and_then([&] { return compensate_with(job, engines_of(job), progress); });
}

Result<report::Report> compensate_with(const Job& job, const Engines& engines, Progress& progress) {
  const auto begin = std::chrono::steady_clock::now();
  std::vector<verify::BlamedRun> kept;
  for (int number = 1;; ++number) {
    report::Report report = new_report("compensate", job);
    report.solver.engine = name_of(engines);
    PassOutcome outcome = pass(job, engines, kept, number == kMostPasses, progress, report);
    if (!outcome.blamed.empty() && number < kMostPasses && can_repeat(job) &&
        !progress.cancelled()) {
      std::ranges::move(outcome.blamed, std::back_inserter(kept));
      continue;
    }
    if (!outcome.status) {
      return tl::unexpected(outcome.status.error());
    }
    if (report.measured.uncompensated.time_s > 0.0 && !job.output_stream) {
      if (!job.settings.is_timing_free()) {
        outcome.time_notes.clear();  // all parts of the print take longer by about the same factor
      }
      if (Status status =
              retime(*job.output, job.output_name, outcome.time_notes,
                     {0, report.measured.uncompensated.time_s, report.measured.compensated.time_s});
          !status) {
        return tl::unexpected(status.error());
      }
    }
    if (Status status = follow_hotend(job, progress, report); !status) {
      return tl::unexpected(status.error());
    }
    if (!job.output_stream) {
      report.measured.output.bytes = static_cast<std::size_t>(job.output->bytes().value_or(0));
    }
    if (!warn_of_no_run(job, report)) {
      std::ranges::move(run::remarks(report.extruded_path, report.unknown_commands, job.input_name),
                        std::back_inserter(report.warnings));
    }
    warn_of_no_gain(job, report);
    warn_of_gap(job, report);
    add_performance(begin, report);
    return report;
  }
}

}  // namespace unflex::flow
