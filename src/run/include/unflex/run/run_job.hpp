// A piece of the input on its way from the reader to the writer. What a run becomes depends on the
// run alone and on how the nozzle would swing if every run before it were compensated, so runs can
// be worked on side by side.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "unflex/compensate/axis_window.hpp"
#include "unflex/compensate/run.hpp"
#include "unflex/compensate/second_stage.hpp"
#include "unflex/dynamics/base_trajectory.hpp"
#include "unflex/emit/emit_options.hpp"
#include "unflex/emit/run.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/run/path_error.hpp"
#include "unflex/run/piece_reader.hpp"
#include "unflex/timing/timing.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::run {

// The stages of the work on a piece. A run goes through all of them, in this order. A piece that
// stays as sliced is lined at once, since there is nothing to work out.
enum class Stage {
  read,
  timed,     // its timing is chosen, if that is free
  laid_out,  // it is divided into windows, or its base came with the timing
  solved,    // all windows are solved
  lined,     // the base is known and cut into lines, or why the run is kept
};

// The outcome of solving one axis of a window.
struct AxisResult {
  dynamics::AxisTrajectory base;
  int iterations = 0;
  std::string failure;  // why there is no solution
};

// A window that another engine is to solve as well.
struct Probe {
  std::size_t slot = 0;  // which of the file's probes it becomes
  std::size_t window = 0;
  std::size_t axis = 0;
  compensate::AxisWindow problem;
  compensate::AxisSolution solution;
};

// A run in another timing than sliced.
struct NewTiming {
  std::vector<planner::PlannedMove> moves;
  std::vector<std::size_t> move_counts;  // as Piece::move_counts
  // The base of the first stage that was found with it; unset: the windows are to be solved.
  std::optional<dynamics::BaseTrajectory> base = {};
};

// The search for the timing of a run whose timing is free.
struct TimingSearch {
  std::vector<timing::MoveBounds> bounds;    // what each move may do; none: there is no search
  std::optional<timing::Extruder> extruder;  // only if the timing depends on it
  // Only for runs of a sample (BandGain): the setup for a narrower band, and how long the run takes
  // with that.
  std::optional<compensate::Setup> narrow_setup;
  std::optional<double> narrow_s;
  std::atomic<std::size_t> nodes = 0;  // solved so far
};

// The windows of a run, and what became of them.
struct RunWindows {
  std::vector<compensate::WindowSpan> spans;
  std::vector<Axes<AxisResult>> results;  // X and Y, one per span
  std::vector<AxisResult> thirds;         // mode 2, one per span, if the setup has one
  std::atomic<std::size_t> unsolved = 0;  // axes of windows
  std::vector<Probe> probes;
};

// Contour error of the nominal axes in a run that suits a band of axes.
struct Robustness {
  bool is_measured = false;
  PathError robust;   // on the emitted base
  PathError nominal;  // on the base optimised for them alone
};

// Rules by which a run is worked on, for the machine as it is while it prints the run.
struct RunRules {
  machine::Settings settings;
  compensate::Setup setup;
  compensate::Setup sliced_setup;  // for runs that keep their timing where it is free
  emit::EmitOptions emit;
  verify::Rules verify;
};

struct RunJob {
  Piece piece;
  std::atomic<Stage> stage = Stage::read;
  // What is between two runs has them only where another tool is taken.
  std::shared_ptr<const RunRules> rules;
  // The members from here on are only used for runs and parts of runs.
  std::string failure;             // why the run is kept
  dynamics::NozzleXY nozzle;       // at its begin, if every run before is compensated
  dynamics::NozzleXY first_stage;  // `nozzle` as a state of the setup's axes
  compensate::Setup setup;
  // Only if the timing is free: the setup in case the timing stays as sliced all the same. Parts of
  // a run have one setup, since they meet in motion.
  std::optional<compensate::Setup> sliced_setup;
  emit::RunAccel accel;
  TimingSearch search;
  std::optional<NewTiming> retimed;  // the new timing, if there is one
  std::string scaled_reason;  // why the timing is not the optimal one, where that is asked for
  std::string slow_reason;    // why the timing stays as sliced
  // By how much the new timing is stretched so that the layer lasts long enough; unset: not known
  // yet.
  std::optional<double> stretch;
  compensate::NodeGrid grid;
  RunWindows windows;
  int lines_after = 0;  // Run::lines_after, counted in the sliced lines
  // Results of make_lines().
  dynamics::BaseTrajectory base;
  emit::RunPlan plan;
  verify::RunDeviation before;  // deviation of the run's sliced moves
  Robustness robustness;
  std::size_t iterations = 0;

  [[nodiscard]] bool has_come_to(Stage at_least) const { return stage >= at_least; }
  // The course that the nozzle shall follow.
  [[nodiscard]] compensate::Course course() const {
    return {piece.before, reference(), piece.after};
  }
  // The run's moves in the timing in which they are compensated.
  [[nodiscard]] const std::vector<planner::PlannedMove>& reference() const {
    return retimed ? retimed->moves : piece.moves;
  }
  // Whether its timing could be free but stays as sliced, apart from what F asks for.
  [[nodiscard]] bool keeps_timing() const { return !slow_reason.empty(); }
  [[nodiscard]] bool has_base() const { return retimed && retimed->base; }
  // How long before the plan the base begins.
  [[nodiscard]] double lead_in_s() const {
    return piece.begins_run() ? setup.lead_in_s + shaping_s() : 0.0;
  }
  // By how much shaping makes a run longer at either end.
  [[nodiscard]] double shaping_s() const {
    return static_cast<double>(compensate::nodes_of_shaping(setup, grid.period_s)) * grid.period_s;
  }
  // The run for the emitter. The arguments are members of emit::Run.
  [[nodiscard]] emit::Run run(double tolerance_share = 1.0, double limits_share = 1.0,
                              std::vector<double> lines_before_s = {}) const;
};

[[nodiscard]] AxisResult axis_result(Result<compensate::AxisSolution> solution);

// There is nothing to work out: the piece is written as it is, for this reason if it is a run.
void keep_as_sliced(RunJob& job, std::string reason = {});

// The run keeps its timing as sliced.
void keep_timing(RunJob& job, std::string reason);

// How the timing of runs is chosen where it is free.
struct TimingChoice {
  bool is_optimal = false;
  const compensate::Engine* engine = nullptr;  // for timing::faster()
};

// Keeps the timing as sliced, but makes it slower where the nozzle, or the base in travel, would
// run ahead of F.
void keep_feed(RunJob& job, const compensate::Engine& engine);

// Chooses the timing of the run, which is timed then. Throws nothing.
void choose_timing(RunJob& job, const TimingChoice& choice) noexcept;

// Stretches the timing of the run to RunJob::stretch times its duration.
void stretch(RunJob& job);

// Divides the run, in its present timing, into windows. The run is laid out then. A run whose base
// is known has no windows.
void lay_out(RunJob& job);

// The job's nozzle, which swings with all the modes of the model, as a state of the axes that the
// windows are for.
[[nodiscard]] dynamics::NozzleXY first_stage(const RunJob& job, const verify::NozzleModel& model);

// The problems of `count` windows of the run from number `first` on.
[[nodiscard]] std::vector<compensate::RunWindow> windows_of(const RunJob& job, std::size_t first,
                                                            std::size_t count);

// Notes that `axes` more axes of windows are solved. Returns whether they were the last, so that
// the run is solved.
bool note_solved(RunJob& job, std::size_t axes);

// Solves these windows. Calls for other windows may run at the same time. Returns note_solved().
bool solve_windows(RunJob& job, std::size_t first, std::size_t count,
                   const compensate::Engine& engine) noexcept;

// Joins the windows of a solved run and cuts its base into lines. Throws nothing.
void make_lines(RunJob& job) noexcept;

}  // namespace unflex::run
