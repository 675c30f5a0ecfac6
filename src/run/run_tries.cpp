#include "unflex/run/run_tries.hpp"

#include <array>
#include <exception>
#include <utility>

namespace unflex::run {
namespace {

// Shares of the motors' acceleration for another timing, after an optimal timing and after a scaled
// one.
constexpr std::array kScaledAfterOptimal = {1.0, 0.9, 0.8};
constexpr std::array kScaledAgain = {0.9, 0.8, 0.7};
// Shares of the motors' acceleration for a base that leaves a reserve to whole steps.
constexpr std::array kReserves = {0.85, 0.7, 0.55};

void solve(RunJob& run) {
  lay_out(run);
  const std::unique_ptr<compensate::Engine> engine = compensate::make_banded_engine();
  solve_windows(run, 0, run.windows.spans.size(), *engine);
  make_lines(run);
}

}  // namespace

Tries::Tries(const RunJob& job, std::string objection, bool whole_steps)
    : objection_(std::move(objection)) {
  if (job.retimed && !job.keeps_timing()) {
    // The lines may break a limit, since the rounded motion swings about the optimised one, and a
    // free timing takes all that the motors give.
    for (const double share : job.has_base() ? kScaledAfterOptimal : kScaledAgain) {
      tries_.push_back({Remedy::scaled, share});
    }
    tries_.push_back({Remedy::as_sliced});
  } else if (whole_steps && job.failure.empty()) {
    // Whole steps ask for more than the base does.
    for (const double share : kReserves) {
      tries_.push_back({Remedy::reserve, share});
    }
  }
}

std::optional<Try> Tries::next() {
  return count_ < tries_.size() ? std::optional(tries_[count_++]) : std::nullopt;
}

std::shared_ptr<RunJob> once_more(const RunJob& job, const Try& next) {
  auto run = std::make_shared<RunJob>();
  run->piece = job.piece;
  run->rules = job.rules;
  run->nozzle = job.nozzle;
  run->first_stage = job.first_stage;
  run->setup = next.remedy == Remedy::as_sliced ? job.sliced_setup.value_or(job.setup) : job.setup;
  for_each_axis(
      [&](compensate::AxisSetup& axis) { axis.limits.max_accel_mm_s2 *= next.accel_share; },
      run->setup);
  run->sliced_setup = job.sliced_setup;
  run->search.bounds = job.search.bounds;
  run->search.extruder = job.search.extruder;
  run->accel = job.accel;
  run->stretch = job.stretch;
  run->lines_after = job.lines_after;
  run->robustness.is_measured = job.robustness.is_measured;
  if (job.keeps_timing()) {
    run->slow_reason = job.slow_reason;
    run->retimed = job.retimed;
  }
  return run;
}

void work_out(RunJob& run, Remedy remedy) noexcept try {
  if (remedy == Remedy::scaled) {
    choose_timing(run, {.is_optimal = false, .engine = compensate::make_rough_engine().get()});
    stretch(run);
  } else if (remedy == Remedy::as_sliced && !run.search.bounds.empty()) {
    keep_feed(run, *compensate::make_rough_engine());
  }
  solve(run);
} catch (const std::exception& exception) {
  // Out of memory, mostly.
  keep_as_sliced(run, exception.what());
}

}  // namespace unflex::run
