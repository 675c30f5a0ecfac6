#include "unflex/run/run_job.hpp"

#include <fmt/core.h>

#include <exception>
#include <memory>
#include <numeric>
#include <optional>
#include <utility>

#include "unflex/emit/emitter.hpp"
#include "unflex/run/judge.hpp"
#include "unflex/run/run_progress.hpp"
#include "unflex/timing/stretched.hpp"

namespace unflex::run {
namespace {

// The first window that failed, if any did.
std::string failure_of(const RunJob& job) {
  for (std::size_t window = 0; window < job.windows.results.size(); ++window) {
    for (std::size_t axis = 0; axis < 2; ++axis) {
      if (const std::string& failure = job.windows.results[window][axis].failure;
          !failure.empty()) {
        return fmt::format("the solver failed on axis {}, window {}: {}", axis == 0 ? 'x' : 'y',
                           window + 1, failure);
      }
    }
  }
  for (std::size_t window = 0; window < job.windows.thirds.size(); ++window) {
    if (const std::string& failure = job.windows.thirds[window].failure; !failure.empty()) {
      return fmt::format("the solver failed on the third mode, window {}: {}", window + 1, failure);
    }
  }
  return {};
}

// The base of the first stage, shaped by the second, from the course's first node on. For a part
// this includes the nodes after its last one.
dynamics::BaseTrajectory both_stages(const RunJob& job, dynamics::BaseTrajectory base) {
  const std::size_t more = compensate::nodes_of_shaping(job.setup, job.grid.period_s);
  base = compensate::shaped(base, job.setup, job.piece.begins_run() ? more : 0,
                            job.piece.ends_run() ? more : 0);
  const auto before = static_cast<std::ptrdiff_t>(job.grid.first);
  const auto trim = [&](dynamics::AxisTrajectory& axis) {
    for (std::vector<double>* values :
         {&axis.position_mm, &axis.velocity_mm_s, &axis.accel_mm_s2}) {
      values->erase(values->begin(), values->begin() + before);
    }
  };
  for_each_axis(trim, base);
  if (base.above) {
    trim(*base.above);
  }
  return base;
}

// Joins what the solvers have found for each axis.
dynamics::BaseTrajectory joined(RunJob& job) {
  Axes<std::vector<dynamics::AxisTrajectory>> solutions;
  for (Axes<AxisResult>& result : job.windows.results) {
    for_each_axis(
        [&](std::vector<dynamics::AxisTrajectory>& all, AxisResult& of_axis) {
          all.push_back(std::move(of_axis.base));
          job.iterations += static_cast<std::size_t>(of_axis.iterations);
        },
        solutions, result);
  }
  dynamics::BaseTrajectory base{
      map_axes([&](const auto& of_axis) { return compensate::join(job.windows.spans, of_axis); },
               solutions),
      job.grid.period_s};
  if (!job.setup.frame) {
    return base;
  }
  std::vector<dynamics::AxisTrajectory> thirds;
  for (AxisResult& third : job.windows.thirds) {
    thirds.push_back(std::move(third.base));
  }
  return compensate::in_axes(
      *job.setup.frame, base,
      thirds.empty() ? std::nullopt : std::optional(compensate::join(job.windows.spans, thirds)),
      job.setup.motors.value_or(compensate::ModeMotors{}).max_z_accel_mm_s2);
}

// The base optimised for the nominal axes alone.
std::optional<dynamics::BaseTrajectory> nominal_base(const RunJob& job) {
  compensate::Setup setup = job.setup;
  for_each_axis([](compensate::AxisSetup& axis) { axis.plants.clear(); }, setup);
  if (setup.contour) {
    setup.jerk_weight = setup.contour->tracking_jerk_weight;
    setup.contour.reset();
  }
  const std::unique_ptr<compensate::Engine> engine = compensate::make_banded_engine();
  auto windows = compensate::windows(job.course(), job.windows.spans, job.first_stage, setup);
  Result<dynamics::BaseTrajectory> base =
      compensate::solve_all(*engine, job.windows.spans, windows);
  return base ? std::optional(both_stages(job, std::move(*base))) : std::nullopt;
}

void measure_robustness(RunJob& job, const verify::NozzleModel& model) {
  if (!job.robustness.is_measured) {
    return;
  }
  if (const std::optional<dynamics::BaseTrajectory> nominal = nominal_base(job)) {
    const std::vector<planner::PlannedMove>& plan = job.reference();
    const double lead_in_s = job.lead_in_s();
    const dynamics::FieldXY field = compensate::field_of(job.setup);
    job.robustness.robust = path_error({plan, lead_in_s, job.base, job.nozzle}, model, field);
    job.robustness.nominal = path_error({plan, lead_in_s, *nominal, job.nozzle}, model, field);
  }
}

// A large window is checked by its beginning, as a problem of its own: Ipopt takes seconds for all
// of a window of several modes.
void set_probe(const compensate::Engine& engine, compensate::AxisWindow window,
               const compensate::AxisSolution& solution, Probe& probe) {
  // Nodes times states. All windows of one mode have fewer, unless solve.window_s is raised.
  constexpr std::size_t kMost = 11000;
  std::size_t states = 3;
  for (std::size_t i = 0; i < window.models(); ++i) {
    states += 2 * window.model(i).axis.mode_count();
  }
  const std::size_t most = std::max<std::size_t>(kMost / states, 2);
  if (window.nodes() <= most) {
    probe.problem = std::move(window);
    probe.solution = solution;
    return;
  }
  for (std::vector<double>* values : {&window.reference_mm, &window.weight, &window.freq_shares}) {
    values->resize(std::min(values->size(), 2 * most - 1));
  }
  for (std::vector<double>& aim_mm : window.aims_mm) {
    aim_mm.resize(2 * most - 1);
  }
  for (std::vector<double>* values : {&window.max_velocity_at_mm_s, &window.max_accel_at_mm_s2}) {
    values->resize(std::min(values->size(), most));
  }
  window.end_base_mm.reset();
  if (Result<compensate::AxisSolution> beginning = engine.solve(window)) {
    probe.problem = std::move(window);
    probe.solution = std::move(*beginning);
  }
}

// If the firmware counts steps, the cut of a run depends on the lines before it. These are not
// known yet, so we assume as many as allowed, at an even pace.
std::vector<double> even_lines_before_s(const emit::LineRules& rules) {
  std::vector<double> begins_s;
  for (int i = rules.burst_lines; i > 0; --i) {
    begins_s.push_back(-i * rules.even_line_s());
  }
  return begins_s;
}

// How many pieces the moves of each event have become.
std::vector<std::size_t> counts_of(const std::vector<std::size_t>& moves,
                                   const std::vector<std::size_t>& pieces) {
  std::vector<std::size_t> counts;
  auto next = pieces.begin();
  for (const std::size_t count : moves) {
    const auto end = next + static_cast<std::ptrdiff_t>(count);
    counts.push_back(std::accumulate(next, end, std::size_t{0}));
    next = end;
  }
  return counts;
}

}  // namespace

emit::Run RunJob::run(double tolerance_share, double limits_share,
                      std::vector<double> lines_before_s) const {
  emit::Run run{.events = &piece.events,
                .move_counts = retimed ? &retimed->move_counts : &piece.move_counts,
                .moves = &reference(),
                .base = &base,
                .lead_in_s = lead_in_s(),
                .tolerance_share = tolerance_share,
                .limits_share = limits_share,
                .accel = accel,
                .lines_before_s = std::move(lines_before_s),
                .lines_after = lines_after,
                .goes_on = !piece.begins_run()};
  if (!piece.ends_run()) {
    run.until_s = static_cast<double>(grid.last - grid.first) * grid.period_s +
                  (piece.begins_run() ? shaping_s() : 0.0);
  }
  return run;
}

AxisResult axis_result(Result<compensate::AxisSolution> solution) {
  if (!solution) {
    return {{}, 0, solution.error().message};
  }
  return {std::move(solution->base), solution->iterations, {}};
}

dynamics::NozzleXY first_stage(const RunJob& job, const verify::NozzleModel& model) {
  if (job.setup.frame) {
    return job.nozzle;
  }
  return map_axes([](const compensate::AxisSetup& setup, const dynamics::FlexibleAxis& axis,
                     const dynamics::NozzleState& nozzle,
                     double start_mm) { return setup.axis.swinging_as(axis, nozzle, start_mm); },
                  job.setup, model, job.nozzle, xy_of(job.piece.moves.front().segment.start_mm));
}

std::vector<compensate::RunWindow> windows_of(const RunJob& job, std::size_t first,
                                              std::size_t count) {
  return compensate::windows(job.course(), job.windows.spans, first, count, job.first_stage,
                             job.setup);
}

void keep_as_sliced(RunJob& job, std::string reason) {
  job.failure = std::move(reason);
  job.stage = Stage::lined;
}

void keep_timing(RunJob& job, std::string reason) {
  job.slow_reason = std::move(reason);
  if (job.sliced_setup) {
    job.setup = *job.sliced_setup;
  }
}

void keep_feed(RunJob& job, const compensate::Engine& engine) {
  if (std::optional<timing::Timed> timed = timing::within_feed(
          job.course(), job.setup, job.first_stage, job.search.bounds, engine)) {
    job.retimed =
        NewTiming{std::move(timed->moves), counts_of(job.piece.move_counts, timed->pieces)};
  }
}

namespace {

struct FoundTiming {
  std::optional<timing::Timed> timed;  // unset: none that is faster
  std::string scaled_reason;           // as RunJob's
};

// Searches from the timing as sliced, whatever has been chosen for the run.
FoundTiming find_timing(const RunJob& job, const compensate::Setup& setup,
                        const TimingChoice& choice) {
  const compensate::Course sliced{job.piece.before, job.piece.moves, job.piece.after};
  FoundTiming found{timing::faster(sliced, setup, job.first_stage, job.search.bounds,
                                   *choice.engine, job.search.extruder),
                    {}};
  if (!choice.is_optimal) {
    return found;
  }
  tl::expected<timing::Timed, std::string> optimal =
      timing::optimal(sliced, setup, job.first_stage, job.search.bounds, job.search.extruder);
  // The optimal motion is the shortest among those near it, so the scaled one may be shorter.
  if (!optimal) {
    found.scaled_reason = std::move(optimal.error());
  } else if (found.timed &&
             planner::duration_s(found.timed->moves) <= planner::duration_s(optimal->moves)) {
    found.scaled_reason = "the scaled timing takes less time than the optimal one that was found";
  } else {
    found.timed = std::move(*optimal);
  }
  return found;
}

}  // namespace

void choose_timing(RunJob& job, const TimingChoice& choice) noexcept {
  try {
    const CountedEngine engine(*choice.engine, job.search.nodes);
    const TimingChoice counted{choice.is_optimal, &engine};
    if (job.search.narrow_setup) {
      const FoundTiming narrow = find_timing(job, *job.search.narrow_setup, counted);
      job.search.narrow_s =
          planner::duration_s(narrow.timed ? narrow.timed->moves : job.piece.moves);
    }
    if (job.keeps_timing()) {
      keep_feed(job, engine);
    } else if (FoundTiming found = find_timing(job, job.setup, counted); found.timed) {
      job.scaled_reason = std::move(found.scaled_reason);
      if (found.timed->plants) {
        for_each_axis(
            [](compensate::AxisSetup& axis, std::vector<compensate::Plant>& plants) {
              axis.plants = std::move(plants);
            },
            job.setup, *found.timed->plants);
      }
      job.retimed = NewTiming{std::move(found.timed->moves),
                              counts_of(job.piece.move_counts, found.timed->pieces),
                              std::move(found.timed->base)};
    } else {
      keep_timing(job, "no faster timing was found that keeps the tolerance");
      keep_feed(job, engine);
    }
  } catch (const std::exception& exception) {
    // Out of memory, mostly.
    job.retimed.reset();
    keep_timing(job, exception.what());
  }
  job.stage = Stage::timed;
}

void stretch(RunJob& job) {
  if (*job.stretch <= 1.0) {
    return;
  }
  if (!job.retimed) {
    job.retimed = NewTiming{job.piece.moves, job.piece.move_counts};
  }
  job.retimed->moves = timing::stretched(job.retimed->moves, *job.stretch);
  job.retimed->base.reset();
  job.piece.before = timing::stretched(job.piece.before, *job.stretch);
  job.piece.after = timing::stretched(job.piece.after, *job.stretch);
}

void lay_out(RunJob& job) {
  job.grid = compensate::node_grid(job.course(), job.setup);
  if (job.has_base()) {
    job.stage = Stage::solved;
    return;
  }
  job.windows.spans = compensate::mesh(job.course(), job.grid, job.setup);
  job.windows.results.resize(job.windows.spans.size());
  job.windows.thirds.resize(job.setup.third ? job.windows.spans.size() : 0);
  job.windows.unsolved = 2 * job.windows.spans.size();
  job.stage = Stage::laid_out;
}

bool note_solved(RunJob& job, std::size_t axes) {
  if (job.windows.unsolved.fetch_sub(axes) != axes) {
    return false;
  }
  job.stage = Stage::solved;
  return true;
}

bool solve_windows(RunJob& job, std::size_t first, std::size_t count,
                   const compensate::Engine& engine) noexcept {
  RunWindows& of_run = job.windows;
  try {
    std::vector<compensate::RunWindow> windows = windows_of(job, first, count);
    for (std::size_t i = 0; i < count; ++i) {
      compensate::AxisSolutions solutions =
          compensate::solve(engine, of_run.spans[first + i], windows[i]);
      if (solutions.third) {
        of_run.thirds[first + i] = axis_result(std::move(*solutions.third));
      }
      for (std::size_t axis = 0; axis < solutions.kCount; ++axis) {
        Result<compensate::AxisSolution>& solution = solutions[axis];
        for (Probe& probe : of_run.probes) {
          if (solution && probe.window == first + i && probe.axis == axis) {
            set_probe(engine, std::move(windows[i][axis]), *solution, probe);
          }
        }
        of_run.results[first + i][axis] = axis_result(std::move(solution));
      }
    }
  } catch (const std::exception& exception) {
    // Out of memory, mostly.
    of_run.results[first][0].failure = exception.what();
  }
  return note_solved(job, 2 * count);
}

void make_lines(RunJob& job) noexcept {
  try {
    const RunRules& rules = *job.rules;
    job.failure = failure_of(job);
    if (job.failure.empty()) {
      if (job.has_base()) {
        job.base = both_stages(job, std::move(*job.retimed->base));
      } else {
        job.base = both_stages(job, joined(job));
        measure_robustness(job, rules.verify.nozzle);
      }
      job.plan = emit::plan_run(job.run(1.0, 1.0, even_lines_before_s(rules.emit.lines)),
                                job.piece.start, rules.emit);
      job.before = deviation_as_sliced(job.piece, job.nozzle, rules.verify);
    }
  } catch (const std::exception& exception) {
    job.failure = exception.what();
  }
  job.windows.results.clear();
  job.windows.thirds.clear();
  job.stage = Stage::lined;
}

}  // namespace unflex::run
