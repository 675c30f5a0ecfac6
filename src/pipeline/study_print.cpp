#include "unflex/pipeline/study_print.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "input_bytes.hpp"
#include "piece_reader.hpp"
#include "stage_options.hpp"

namespace unflex::pipeline {
namespace {

// Runs are taken together until they last this long: enough for all threads, little memory.
constexpr double kBatch_s = 20.0;
constexpr double kSampleStep_s = 2e-4;
constexpr int kParts = 5;

study::BenchSetup bench_setup(const machine::Settings& settings) {
  study::BenchSetup setup;
  setup.unflex = compensate_setup(settings);
  setup.plan_accel_mm_s2 = settings.limits.max_accel_mm_s2;
  setup.thesis_period_s = setup.unflex.period_s;
  setup.step_s = kSampleStep_s;
  setup.parts = kParts;
  return setup;
}

std::string describe(const machine::Settings& settings) {
  return fmt::format("X {}; Y {}; {} mm/s²", settings.dynamics_x.description(),
                     settings.dynamics_y.description(), settings.limits.max_accel_mm_s2);
}

}  // namespace

Result<study::Outcome> study_print(const Job& job, bool traces, Progress& progress) {
  std::ifstream input(job.input, std::ios::binary);
  if (!input) {
    return fail(ErrorKind::input, {job.input_name, 0}, "cannot read the file");
  }
  const double bytes = input_bytes(job);
  PieceReader reader(input, job.input_name, interpreter_options(job.settings),
                     planner_limits(job.settings), firmware_config(job.settings));
  const study::BenchSetup setup = bench_setup(job.settings);
  const study::Options options{.ipopt = job.engine == EngineChoice::ipopt, .workers = job.workers};
  study::Outcome outcome;
  outcome.input = job.input_name;
  outcome.engine = study::engine_name(options);
  study::CaseResult result{"print", describe(job.settings), 0.0, 0, {}};
  std::vector<study::Run> batch;
  double batch_s = 0.0;
  study::Run worst;
  double worst_mm = -1.0;
  for (bool more = true; more;) {
    Piece piece;
    const Result<bool> read = reader.next(piece);
    if (!read) {
      return tl::unexpected(read.error());
    }
    more = *read;
    if (piece.is_run) {
      batch_s += planner::duration_s(piece.moves);
      if (piece.begins_run()) {
        batch.emplace_back();
      }
      std::ranges::move(piece.moves, std::back_inserter(batch.back().plan));
    }
    // A long run comes in parts, but is tried as a whole.
    const bool inside = piece.is_run && !piece.ends_run();
    if (!batch.empty() && !inside && (!more || batch_s >= kBatch_s)) {
      const std::size_t number = study::study_runs(batch, setup, options, result);
      // The largest error of all runs so far is now known.
      const double max_mm = result.methods.front().straying[0].max_mm;
      if (max_mm > worst_mm) {
        worst_mm = max_mm;
        worst = std::move(batch[number]);
      }
      batch.clear();
      batch_s = 0.0;
    }
    progress.update("studying", share_of_input(static_cast<double>(reader.bytes_read()), bytes));
    if (progress.cancelled()) {
      return fail(ErrorKind::internal, "cancelled");
    }
  }
  if (result.runs == 0) {
    return fail(ErrorKind::input, {job.input_name, 0},
                "has no stretch that could be compensated; unflex inspect tells why");
  }
  if (traces) {
    study::trace_worst_place(worst, setup, options, result);
  }
  outcome.cases.push_back(std::move(result));
  for (const Diagnostic& warning : reader.warnings()) {
    outcome.warnings.push_back(to_string(warning));
  }
  return outcome;
}

}  // namespace unflex::pipeline
