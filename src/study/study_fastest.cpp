#include "unflex/study/study_fastest.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <istream>
#include <memory>
#include <string>
#include <utility>

#include "in_memory.hpp"
#include "unflex/machine/as_printer.hpp"
#include "unflex/run/piece_reader.hpp"

namespace unflex::study {
namespace {

// Gathers the path of a print, and its plan as the printer would make it.
class PathCollector {
 public:
  PathCollector(const planner::Limits& limits, const planner::FirmwareConfig& config)
      : planner_(planner::make_planner(limits, config)) {
    path.config = config;
  }

  void add(const gcode::Event& event) {
    if (event.kind == gcode::EventKind::move) {
      for (gcode::Segment segment : event.segments) {
        planner_->add(segment);
        if (segment.length_mm() > 0.0) {
          segment.feed_mm_s = std::min(segment.feed_mm_s, planner_->limits().max_velocity_mm_s);
        }
        open_.push_back(segment);
      }
      return;
    }
    planner_->apply(event);
    if (event.kind == gcode::EventKind::barrier) {
      path.dwell_s += event.dwell_s;
      stop();
    }
  }

  // The machine comes to rest.
  void stop() {
    planner_->stop();
    study::StretchPlan plan;
    if (planner_->take(plan) > 0) {
      as_sliced.push_back(std::move(plan));
    }
    if (!open_.empty()) {
      path.stretches.push_back(std::exchange(open_, {}));
    }
  }

  study::PrintPath path;
  std::vector<study::StretchPlan> as_sliced;

 private:
  std::unique_ptr<planner::Planner> planner_;
  study::Stretch open_;
};

bool lays_filament(const study::PrintPath& path) {
  return std::ranges::any_of(path.stretches, [](const study::Stretch& stretch) {
    return std::ranges::any_of(stretch, &gcode::Segment::extruding);
  });
}

study::PathErrors errors_of(const report::Report& report) {
  return {report.measured.compensated.extruding.contour_p999_mm,
          report.measured.compensated.extruding.contour_max_mm};
}

// The print compensated so that it keeps the tolerance, if that is found. What is written may stray
// a little more than timing.tolerance_um allows the base, so that a strict rule needs less of it.
Result<report::Report> within(const flow::Job& job, double tolerance_mm,
                              const study::ToleranceRule& rule, Progress& progress) {
  constexpr int kTries = 3;
  constexpr double kMargin = 0.99;
  flow::Job at = job;
  at.settings.timing.tolerance_um = 1e3 * tolerance_mm;
  for (int tries = 1;; ++tries) {
    Result<report::Report> report =
        compensate_in_memory(at, fmt::format("{:g} µm", 1e3 * tolerance_mm), progress);
    if (!report || tries == kTries || rule.keeps(errors_of(*report), tolerance_mm)) {
      return report;
    }
    const study::PathErrors errors = errors_of(*report);
    at.settings.timing.tolerance_um *=
        kMargin * std::min({1.0, tolerance_mm / errors.p999_mm,
                            rule.largest_times * tolerance_mm / errors.max_mm});
  }
}

// unflex as a contender: the print compensated with each tolerance, as the emitted text replays.
// Warns of the parts that unflex keeps as sliced.
Result<study::FastestOfContender> unflex_of(const flow::Job& job,
                                            const std::vector<double>& tolerances_mm,
                                            const study::ToleranceRule& rule, Progress& progress,
                                            std::vector<std::string>& warnings) {
  study::FastestOfContender unflex{std::string(study::kUnflex), {}, {}};
  for (const double tolerance_mm : tolerances_mm) {
    // The grid counts as much as all of these together.
    PartProgress part(progress, unflex.at.size(), 2 * tolerances_mm.size());
    const Result<report::Report> report = within(job, tolerance_mm, rule, part);
    if (!report) {
      return tl::unexpected(report.error());
    }
    const study::PathErrors errors = errors_of(*report);
    const auto warn = [&](std::string what) {
      warnings.push_back(
          fmt::format("warning: within {:g} µm unflex {}", 1e3 * tolerance_mm, what));
    };
    unflex.at.emplace_back();
    if (rule.keeps(errors, tolerance_mm)) {
      unflex.at.back() = {std::nullopt, report->measured.compensated.time_s, errors};
    } else {
      warn(fmt::format(
          "takes {:.2f} s, but strays {:.2f} µm for 99.9 % of the time and {:.2f} µm "
          "at most",
          report->measured.compensated.time_s, 1e3 * errors.p999_mm, 1e3 * errors.max_mm));
    }
    if (const std::size_t kept = report->runs.fallback; kept > 0) {
      warn(fmt::format("keeps {} of {} runs as they were sliced", kept, report->runs.total));
    }
    if (const std::size_t kept = report->free_timing.pieces_as_sliced; kept > 0) {
      warn(fmt::format("keeps the timing of {} stretch{} as sliced", kept, kept == 1 ? "" : "es"));
    }
    for (const std::string& warning : report->warnings) {
      if (std::ranges::find(warnings, warning) == warnings.end()) {
        warnings.push_back(warning);
      }
    }
  }
  return unflex;
}

}  // namespace

machine::Settings settings_of_fastest(machine::Settings settings) {
  for (auto& [key, origin] : settings.origins) {
    if (key == "dynamics.freq_error" && origin == machine::kDefaultOrigin) {
      settings.dynamics_error.freq = 0.0;
      origin = "study --faster";
    }
  }
  return settings;
}

Result<study::FastestOutcome> study_fastest(const flow::Job& job,
                                            const std::vector<double>& tolerances_mm,
                                            const study::ToleranceRule& rule, Progress& progress) {
  const std::unique_ptr<std::istream> input = job.input->read();
  if (!*input) {
    return fail(ErrorKind::input, {job.input_name, 0}, "cannot read the file");
  }
  const planner::Limits limits = machine::planner_limits(job.settings);
  const planner::FirmwareConfig config = machine::firmware_config(job.settings);
  run::PieceReader reader(*input, job.input_name, machine::interpreter_options(job.settings),
                          limits, config);
  PathCollector collector(limits, config);
  for (bool more = true; more;) {
    run::Piece piece;
    const Result<bool> read = reader.next(piece);
    if (!read) {
      return tl::unexpected(read.error());
    }
    more = *read;
    for (const gcode::Event& event : piece.events) {
      collector.add(event);
    }
    if (progress.cancelled()) {
      return fail(ErrorKind::internal, "cancelled");
    }
  }
  collector.stop();
  if (!lays_filament(collector.path)) {
    return fail(ErrorKind::input, {job.input_name, 0}, "lays no filament; give a sliced print");
  }
  // Before the grid, since workers are forked while there are no threads.
  std::vector<std::string> warnings;
  for (const Diagnostic& warning : reader.warnings()) {
    warnings.push_back(to_string(warning));
  }
  Result<study::FastestOfContender> unflex =
      unflex_of(job, tolerances_mm, rule, progress, warnings);
  if (!unflex) {
    return tl::unexpected(unflex.error());
  }
  PartProgress rest(progress, 1, 2);
  Result<study::FastestOutcome> outcome =
      study_fastest(collector.path, collector.as_sliced,
                    {.nozzle = machine::nozzle_axes(job.settings),
                     .tolerances_mm = tolerances_mm,
                     .rule = rule,
                     .workers = job.workers},
                    rest);
  if (outcome) {
    outcome->contenders.push_back(std::move(*unflex));
    outcome->freq_error = job.settings.freq_error();
    outcome->input = job.input_name;
    outcome->description = fmt::format("X {}; Y {}", job.settings.dynamics.x.description(),
                                       job.settings.dynamics.y.description());
    outcome->warnings.insert(outcome->warnings.end(), warnings.begin(), warnings.end());
  }
  return outcome;
}

}  // namespace unflex::study
