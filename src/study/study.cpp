#include "unflex/study/study.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <iterator>
#include <memory>

#include "tasks.hpp"
#include "unflex/compensate/band.hpp"
#include "unflex/core/threads.hpp"

namespace unflex::study {
namespace {

constexpr double kLeadIn_s = 0.01;
constexpr double kLeastTail_s = 0.02;
constexpr double kJerkWeight = 0.1;
// More than two periods of the softest case, so that any ringing has shown its largest swing.
constexpr double kHold_s = 0.25;
constexpr double kTraceStep_s = 5e-4;
constexpr double kTraceTail_s = 0.06;
// Time traced before and after the worst place of a print.
constexpr double kTraceAround_s = 0.06;
// Coarse-to-fine is measured with the acceleration that unflex may use by default, in multiples of
// the plan's.
constexpr double kChainMultiple = 4.0;
// If all cases are run, coarse-to-fine is measured on the reference, the softest and the least
// damped case.
constexpr std::array<std::string_view, 3> kChainCases = {"ref", "1A", "2A"};

Run run_of(const Case& of) {
  return {corner(of, of.accel_mm_s2), corner(of, 0.5 * of.accel_mm_s2)};
}

std::string describe(const Case& of) {
  return fmt::format("ω {} rad/s, ζ {}, {} mm/s², {} mm/s, step {} ms", of.axis.main_rad_s(),
                     of.axis.main_damping_ratio(), of.accel_mm_s2, of.velocity_mm_s,
                     of.period_s * 1e3);
}

// Cases 5A and 5B change only the thesis' nodes. So all methods but the thesis' own move as in the
// reference.
void drop_repeated_traces(const Case& of, BenchResult& methods) {
  if (of.name != "5A" && of.name != "5B") {
    return;
  }
  for (MethodResult& result : methods) {
    if (result.method != Method::uncompensated && result.method != Method::thesis_least_squares &&
        result.method != Method::thesis_velocity_defects) {
      result.trace = {};
    }
  }
}

Result<std::vector<Case>> chosen(const std::vector<std::string>& names) {
  const auto all = thesis_cases();
  if (names.empty()) {
    return std::vector<Case>(all.begin(), all.end());
  }
  std::vector<Case> result;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(all, name, &Case::name);
    if (found == all.end()) {
      std::string known;
      for (const Case& of : all) {
        known += fmt::format("{}{}", known.empty() ? "" : ", ", of.name);
      }
      return fail(ErrorKind::usage, fmt::format("--case {}: there are {}", name, known));
    }
    result.push_back(*found);
  }
  return result;
}

std::vector<Case> chain_cases(const std::vector<Case>& cases, const Options& options) {
  std::vector<Case> result;
  for (const Case& of : cases) {
    if (!options.cases.empty() || std::ranges::find(kChainCases, of.name) != kChainCases.end()) {
      result.push_back(of);
    }
  }
  return result;
}

Result<std::vector<ChainResult>> chains(const std::vector<Case>& cases,
                                        const compensate::Engine& engine) {
  std::vector<ChainResult> result;
  for (const Case& of : cases) {
    Result<std::vector<ChainStep>> steps =
        coarse_to_fine(run_of(of), corner_setup(of), kChainMultiple, engine);
    if (!steps) {
      return tl::unexpected(steps.error());
    }
    result.push_back({std::string(of.name), engine.name(), std::move(*steps)});
  }
  return result;
}

// The setup as `compensate` makes it for an axis of which only one frequency is given, and that may
// be off: with the band, a mode that nobody has measured, and freedom along the path.
compensate::Setup in_band(compensate::Setup setup) {
  for_each_axis(
      [](compensate::AxisSetup& of) {
        const compensate::Plant unknown = compensate::with_unknown_mode(of.axis);
        of.plants = compensate::edges(of.axis, {.freq_error = kBandError}, 1.0 - unknown.share);
        of.plants.insert(of.plants.begin(), unknown);
      },
      setup);
  setup.contour = compensate::Contour{.tracking_jerk_weight = setup.jerk_weight,
                                      .pairs = compensate::pairs_of(setup)};
  return setup;
}

}  // namespace

BenchSetup corner_setup(const Case& of) {
  BenchSetup setup;
  for_each_axis([&](compensate::AxisSetup& axis) { axis.axis = of.axis; }, setup.unflex);
  setup.unflex.lead_in_s = kLeadIn_s;
  setup.unflex.tail_s =
      std::max(8.0 * of.axis.main_damping_ratio() / of.axis.main_rad_s(), kLeastTail_s);
  setup.unflex.jerk_weight = kJerkWeight;
  setup.unflex_band = in_band(setup.unflex);
  setup.plan_accel_mm_s2 = of.accel_mm_s2;
  setup.thesis_period_s = of.period_s;
  setup.hold_s = kHold_s;
  return setup;
}

Result<Outcome> study_corner(const Options& options, Progress& progress) {
  const Result<std::vector<Case>> cases = chosen(options.cases);
  if (!cases) {
    return tl::unexpected(cases.error());
  }
  const auto engine = make_engine(options);
  // Ipopt's chains take longest, so they come first.
  std::vector<std::unique_ptr<compensate::Engine>> chaining;
  if (compensate::has_ipopt_engine()) {
    chaining.push_back(compensate::make_ipopt_engine());
  }
  chaining.push_back(compensate::make_banded_engine());
  Outcome outcome;
  outcome.engine = engine->name();
  outcome.cases.resize(cases->size());
  std::vector<Result<std::vector<ChainResult>>> measured(chaining.size());
  const std::vector<Case> chained = chain_cases(*cases, options);
  Mutex mutex;
  std::size_t done = 0;
  const std::size_t tasks = chaining.size() + cases->size();
  in_parallel(tasks, threads(options), [&](std::size_t task) {
    if (progress.cancelled()) {
      return;
    }
    if (task < chaining.size()) {
      measured[task] = chains(chained, *chaining[task]);
    } else {
      const std::size_t number = task - chaining.size();
      const Case& of = (*cases)[number];
      BenchSetup setup = corner_setup(of);
      const Run run = run_of(of);
      setup.trace_step_s = options.traces ? kTraceStep_s : 0.0;
      setup.trace_from_s = -setup.unflex.lead_in_s;
      setup.trace_to_s = planner::duration_s(run.plan) + kTraceTail_s;
      CaseResult& result = outcome.cases[number];
      result = {std::string(of.name),          describe(of),
                planner::duration_s(run.plan), 1,
                try_all(run, setup, *engine),  xy_of(run.plan.front().segment.end_mm)};
      drop_repeated_traces(of, result.methods);
    }
    const Lock lock(mutex);
    progress.update("studying", static_cast<double>(++done) / static_cast<double>(tasks));
  });
  if (progress.cancelled()) {
    return fail(ErrorKind::internal, "cancelled");
  }
  for (Result<std::vector<ChainResult>>& of_engine : measured) {
    if (!of_engine) {
      return tl::unexpected(of_engine.error());
    }
    std::ranges::move(*of_engine, std::back_inserter(outcome.chains));
  }
  return outcome;
}

std::string engine_name(const Options& options) { return make_engine(options)->name(); }

std::size_t study_runs(const std::vector<Run>& runs, const BenchSetup& setup,
                       const Options& options, CaseResult& result) {
  const auto engine = make_engine(options);
  std::vector<BenchResult> results(runs.size());
  in_parallel(runs.size(), threads(options),
              [&](std::size_t i) { results[i] = try_all(runs[i], setup, *engine); });
  const auto worst = std::ranges::max_element(
      results, {}, [](const BenchResult& of_run) { return of_run.front().straying[0].max_mm; });
  const auto worst_number = static_cast<std::size_t>(worst - results.begin());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    result.plan_s += planner::duration_s(runs[i].plan);
    ++result.runs;
    if (result.methods.empty()) {
      result.methods = std::move(results[i]);
    } else {
      merge(result.methods, results[i]);
    }
  }
  return worst_number;
}

void trace_worst_place(const Run& run, BenchSetup setup, const Options& options,
                       CaseResult& result) {
  const double end_s = planner::duration_s(run.plan);
  const double at_s = result.methods.front().straying[0].max_at_s;
  setup.trace_step_s = kTraceStep_s;
  setup.trace_from_s = std::max(at_s - kTraceAround_s, -setup.unflex.lead_in_s);
  setup.trace_to_s = std::min(at_s + kTraceAround_s, end_s + kTraceTail_s);
  BenchResult traced = try_all(run, setup, *make_engine(options));
  for (std::size_t i = 0; i < traced.size(); ++i) {
    result.methods[i].trace = std::move(traced[i].trace);
  }
  result.focus_mm = map_axes(
      [&](const rivals::AxisPath& path) { return rivals::PathCursor(path).at(at_s).position; },
      rivals::on_axes_of(run.plan, rivals::reference_path));
}

}  // namespace unflex::study
