#include "unflex/pipeline/study_fastest.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <utility>

#include "piece_reader.hpp"
#include "stage_options.hpp"

namespace unflex::pipeline {
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
    planner_->apply(*event.limits);
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

}  // namespace

Result<study::FastestOutcome> study_fastest(const Job& job,
                                            const std::vector<double>& tolerances_mm,
                                            const study::ToleranceRule& rule, Progress& progress) {
  std::ifstream input(job.input, std::ios::binary);
  if (!input) {
    return fail(ErrorKind::input, {job.input_name, 0}, "cannot read the file");
  }
  const planner::Limits limits = planner_limits(job.settings);
  const planner::FirmwareConfig config = firmware_config(job.settings);
  PieceReader reader(input, job.input_name, interpreter_options(job.settings), limits, config);
  PathCollector collector(limits, config);
  for (bool more = true; more;) {
    Piece piece;
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
  Result<study::FastestOutcome> outcome =
      study::study_fastest(collector.path, collector.as_sliced,
                           {.nozzle = {nozzle_x(job.settings), nozzle_y(job.settings)},
                            .tolerances_mm = tolerances_mm,
                            .rule = rule,
                            .workers = job.workers},
                           progress);
  if (outcome) {
    outcome->input = job.input_name;
    outcome->description = fmt::format("X {}; Y {}", job.settings.dynamics_x.description(),
                                       job.settings.dynamics_y.description());
    for (const Diagnostic& warning : reader.warnings()) {
      outcome->warnings.push_back(to_string(warning));
    }
  }
  return outcome;
}

}  // namespace unflex::pipeline
