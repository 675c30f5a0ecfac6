// The whole study: cases on the bench, and its reports.
#pragma once

#include <string>
#include <vector>

#include "unflex/compensate/axis_window.hpp"
#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/report/report.hpp"
#include "unflex/study/bench.hpp"
#include "unflex/study/case.hpp"
#include "unflex/study/coarse_to_fine.hpp"

namespace unflex::study {

// One case of the thesis, or a print.
struct CaseResult {
  std::string name;
  std::string description;  // "ω 100 rad/s, ζ 0.5, 5000 mm/s², 100 mm/s, step 5 ms"
  double plan_s = 0.0;      // duration of the plan
  std::size_t runs = 1;
  BenchResult methods;
  // The place that the figures zoom in on. For a print it is the worst uncompensated place.
  XY focus_mm = {};
};

struct ChainResult {
  std::string case_name;
  std::string engine;
  std::vector<ChainStep> steps;
};

struct Outcome {
  std::string version;
  std::string input;                     // the print's name; empty for the thesis' cases
  std::string engine;                    // engine that made unflex' bases
  std::vector<report::Setting> printer;  // settings of a print
  std::vector<CaseResult> cases;
  std::vector<ChainResult> chains;
  std::vector<std::string> warnings;
  double wall_s = 0.0;
};

struct Options {
  bool ipopt =
      false;  // unflex' bases by Ipopt, which must be built in, instead of the banded engine
  unsigned workers = 1;                 // threads; the result does not depend on them
  std::vector<std::string> cases = {};  // names of those to run; none: all
  bool traces = false;                  // record traces for the figures
};

// The bench of a thesis case: nodes at 1 ms, 10 ms of lead-in, a tail of 8ζ/ω but at least 20 ms,
// and little weight on the jerk (docs/study.md).
[[nodiscard]] BenchSetup corner_setup(const Case& of);

// Studies the thesis' cases. An error of kind usage if options name an unknown case.
[[nodiscard]] Result<Outcome> study_corner(const Options& options, Progress& progress);

// Name of the engine that makes unflex' bases.
[[nodiscard]] std::string engine_name(const Options& options);

// Tries all methods on the runs of a print and adds the results to `result`, in the order of the
// runs. Returns the index of the run whose nozzle strays most uncompensated.
std::size_t study_runs(const std::vector<Run>& runs, const BenchSetup& setup,
                       const Options& options, CaseResult& result);

// Adds traces to `result`: the run around its worst uncompensated place.
void trace_worst_place(const Run& run, BenchSetup setup, const Options& options,
                       CaseResult& result);

// Tables for people.
[[nodiscard]] std::string to_text(const Outcome& outcome);

// The report as JSON with the keys of docs/study.md, two spaces of indentation, final newline.
[[nodiscard]] std::string to_json(const Outcome& outcome);

// One self-contained page with tables and, where the outcome has traces, figures.
[[nodiscard]] std::string to_html(const Outcome& outcome);

}  // namespace unflex::study
