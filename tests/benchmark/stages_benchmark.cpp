// The cost of each stage on a piece of a real print, in ns per move, per node of the base, or per
// ms of print. docs/performance.md has the figures.
#include <benchmark/benchmark.h>

#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "heatshrink.hpp"
#include "unflex/emit/emitter.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/run/emit_options.hpp"
#include "unflex/run/judge.hpp"
#include "unflex/run/run_job.hpp"
#include "unflex/run/setup.hpp"
#include "unflex/run/verify_rules.hpp"

namespace unflex::flow {
namespace {

const std::string& print() {
  static const std::string text = [] {
    std::ifstream file(UNFLEX_PRINT, std::ios::binary);
    std::ostringstream content;
    content << file.rdbuf();
    return content.str();
  }();
  return text;
}

machine::Settings settings(const std::string& firmware) {
  return machine::load(std::nullopt, {"printer.firmware=" + firmware, "dynamics.freq_error=0"})
      .value();
}

run::RunRules rules_of(const machine::Settings& s) {
  return {s, run::compensate_setup(s), run::compensate_setup(s), run::emit_options(s, "benchmark"),
          run::verify_rules(s)};
}

std::vector<run::Piece> pieces(const run::RunRules& rules) {
  std::istringstream stream(print());
  run::PieceReader reader(stream, "print", rules.verify.interpreter, rules.verify.limits,
                          rules.verify.fixed);
  std::vector<run::Piece> result(1);
  while (reader.next(result.back()).value()) {
    result.emplace_back();
  }
  result.pop_back();
  return result;
}

// The longest run, ready to be solved.
std::unique_ptr<run::RunJob> job_of(const machine::Settings& s, const run::RunRules& rules) {
  auto job = std::make_unique<run::RunJob>();
  for (run::Piece& piece : pieces(rules)) {
    if (piece.is_run && piece.moves.size() > job->piece.moves.size()) {
      job->piece = std::move(piece);
    }
  }
  job->nozzle = {{job->piece.moves.front().segment.start_mm[gcode::X], 0.0},
                 {job->piece.moves.front().segment.start_mm[gcode::Y], 0.0}};
  job->rules = std::make_shared<run::RunRules>(rules);
  job->setup = run::setup_for(rules.setup, job->piece, job->nozzle, s).setup;
  job->grid = compensate::node_grid(job->course(), rules.setup);
  job->windows.spans = compensate::mesh(job->course(), job->grid, rules.setup);
  job->windows.results.resize(job->windows.spans.size());
  return job;
}

void per(benchmark::State& state, const char* what, double count) {
  state.counters[what] = benchmark::Counter(
      count, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

void ReadAndPlan(benchmark::State& state) {
  const run::RunRules rules = rules_of(settings("klipper"));
  std::size_t moves = 0;
  for (const run::Piece& piece : pieces(rules)) {
    moves += piece.moves.size();
  }
  for (auto _ : state) {
    benchmark::DoNotOptimize(pieces(rules));
  }
  state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(print().size()));
  per(state, "per_move", static_cast<double>(moves));
}
BENCHMARK(ReadAndPlan)->Unit(benchmark::kMillisecond);

// accel: the base's limit in mm/s²; 0 for the default, which hardly any window reaches.
void Solve(benchmark::State& state, compensate::Engine& engine, double accel) {
  const machine::Settings s = settings("klipper");
  const auto job = job_of(s, rules_of(s));
  if (accel > 0.0) {
    job->setup.x.limits.max_accel_mm_s2 = job->setup.y.limits.max_accel_mm_s2 = accel;
  }
  std::vector<compensate::RunWindow> windows = run::windows_of(*job, 0, job->windows.spans.size());
  double nodes = 0.0;
  for (const compensate::RunWindow& window : windows) {
    nodes += 2.0 * static_cast<double>(window.x.nodes());
  }
  for (auto _ : state) {
    for (const compensate::RunWindow& window : windows) {
      benchmark::DoNotOptimize(engine.solve(window.x));
      benchmark::DoNotOptimize(engine.solve(window.y));
    }
  }
  per(state, "per_node_and_axis", nodes);
}
void SolveBanded(benchmark::State& state) {
  Solve(state, *compensate::make_banded_engine(), static_cast<double>(state.range(0)));
}
BENCHMARK(SolveBanded)->Arg(0)->Arg(8000)->Unit(benchmark::kMillisecond);
void SolveIpopt(benchmark::State& state) {
  Solve(state, *compensate::make_ipopt_engine(), static_cast<double>(state.range(0)));
}
BENCHMARK(SolveIpopt)->Arg(0)->Arg(8000)->Unit(benchmark::kMillisecond);

void CutIntoLines(benchmark::State& state, const std::string& firmware) {
  const machine::Settings s = settings(firmware);
  const run::RunRules rules = rules_of(s);
  const auto job = job_of(s, rules);
  run::solve_windows(*job, 0, job->windows.spans.size(), *compensate::make_banded_engine());
  run::make_lines(*job);
  for (auto _ : state) {
    benchmark::DoNotOptimize(emit::plan_run(job->run(), job->piece.start, rules.emit));
  }
  per(state, "per_node", static_cast<double>(job->base.nodes()));
}
BENCHMARK_CAPTURE(CutIntoLines, klipper, "klipper")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(CutIntoLines, marlin, "marlin")->Unit(benchmark::kMillisecond);

void Measure(benchmark::State& state) {
  const machine::Settings s = settings("klipper");
  const run::RunRules rules = rules_of(s);
  const auto job = job_of(s, rules);
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        verify::measure(job->piece.moves, job->piece.moves, job->nozzle, rules.verify.nozzle));
  }
  per(state, "per_ms_of_print", 1e3 * planner::duration_s(job->piece.moves));
}
BENCHMARK(Measure)->Unit(benchmark::kMillisecond);

// Repeating text is the worst case: it has the most places to search.
void PackRepeats(benchmark::State& state) {
  const std::string bytes(static_cast<std::size_t>(state.range(0)), 'a');
  for (auto _ : state) {
    benchmark::DoNotOptimize(container::heatshrink(bytes, 12));
  }
  state.SetBytesProcessed(state.iterations() * state.range(0));
}
BENCHMARK(PackRepeats)->Range(1 << 16, 1 << 20)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace unflex::flow
