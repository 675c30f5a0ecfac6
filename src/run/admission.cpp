#include "unflex/run/admission.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstddef>
#include <utility>

namespace unflex::run {
namespace {

// The trajectory of a run or part is held as a whole, 48 bytes per node. A run or part with more
// nodes is kept. Only a single long move can make a part exceed this limit.
constexpr std::size_t kMaxRunNodes = 8'000'000;
// A plan may come out above a limit by rounding.
constexpr double kRounding = 1.0 + 1e-6;

double largest_motor_accel(const std::vector<planner::PlannedMove>& moves, const Motors& motors) {
  double largest = 0.0;
  for (const planner::PlannedMove& move : moves) {
    if (move.accel_s + move.decel_s > 0.0) {
      largest = std::max(
          largest,
          move.accel_mm_s2 * motors.largest_of_xy(xy_of(move.direction), move.direction[gcode::Z]));
    }
  }
  return largest;
}

// Mass and height in the middle of the run, and the mean of its places.
machine::MachineState state_in_middle(const Piece& run, double filament_g_per_mm) {
  const gcode::Position& begin = run.moves.front().segment.start_mm;
  const gcode::Position& end = run.moves.back().segment.end_mm;
  XY sum_mm_s;
  for (const planner::PlannedMove& move : run.moves) {
    const gcode::Segment& segment = move.segment;
    sum_mm_s =
        sum_mm_s + 0.5 * move.duration_s() * (xy_of(segment.start_mm) + xy_of(segment.end_mm));
  }
  return {filament_g_per_mm * 0.5 * (begin[gcode::E] + end[gcode::E]),
          0.5 * (begin[gcode::Z] + end[gcode::Z]), sum_mm_s / planner::duration_s(run.moves),
          run.tool};
}

}  // namespace

Admission::Admission(MachineModel& machine, std::string input_name,
                     const std::vector<verify::BlamedRun>& kept, report::Report& report)
    : machine_(&machine),
      rules_(machine.at({})),
      tool_(machine.as_given().settings.tools.empty() ? std::optional(0) : std::nullopt),
      input_name_(std::move(input_name)),
      kept_(&kept),
      report_(&report),
      nozzle_(rules_->verify.nozzle, rules_->verify.fixed,
              gcode::Interpreter(rules_->emit.interpreter).state().shaper) {}

void Admission::admit(RunJob& job) {
  if (!job.piece.is_run) {
    keep_lines(job);
    return;
  }
  const Piece& piece = job.piece;
  // The middle of the piece stands for the whole. Parts of a run meet in motion, but hardly
  // anything changes from one to the next.
  rules_ = machine_->at(state_in_middle(piece, rules_->settings.filament_g_per_mm()));
  nozzle_.set_model(rules_->verify.nozzle);
  job.rules = rules_;
  report_->runs.total += piece.begins_run() ? 1 : 0;
  const double asked_accel_mm_s2 = prepare(job);
  const std::vector<std::string> blamed = blamed_before(piece);
  // A run of free timing gets another chance in the timing as sliced.
  const std::size_t chances = rules_->settings.is_timing_free() ? 2 : 1;
  std::string reason = blamed.size() >= chances ? blamed.back() : refusal(job, asked_accel_mm_s2);
  if (!reason.empty()) {
    keep_as_sliced(job, std::move(reason));
    return;
  }
  if (!rules_->settings.is_timing_free()) {
    job.stage = Stage::timed;
  } else if (piece.begins_run() && piece.ends_run()) {
    job.sliced_setup =
        setup_for(job.rules->sliced_setup, piece, job.nozzle, job.rules->settings).setup;
  }
  if (!blamed.empty()) {
    keep_timing(job, blamed.back());
  }
}

void Admission::keep_lines(RunJob& job) {
  if (job.piece.tool != tool_) {
    tool_ = job.piece.tool;
    rules_ = machine_->at({.tool = job.piece.tool});
    job.rules = rules_;
    nozzle_.set_model(rules_->verify.nozzle);
  }
  static_cast<void>(nozzle_.follow(job.piece));
  for (const gcode::Event& event : job.piece.events) {
    count_kept_moves(event, rules_->verify.fixed.firmware, report_->runs.kept_moves);
  }
  keep_as_sliced(job);
}

// Sets the values with which the run is worked out. Returns the largest acceleration that its plan
// asks for.
double Admission::prepare(RunJob& job) {
  const Piece& piece = job.piece;
  job.nozzle = nozzle_at(piece);
  RunSetup setup = setup_for(job.rules->setup, piece, job.nozzle, job.rules->settings);
  warn_if_capped(setup, piece);
  job.setup = std::move(setup.setup);
  job.accel = setup.accel;
  job.first_stage = first_stage(job, job.rules->verify.nozzle);
  job.grid = compensate::node_grid(job.course(), job.setup);
  return setup.asked_accel_mm_s2;
}

// The nozzle where the run begins. Goes on to the run's end.
dynamics::NozzleXY Admission::nozzle_at(const Piece& run) {
  const verify::NozzleModel& model = rules_->verify.nozzle;
  static_cast<void>(nozzle_.begin_run(run));
  const dynamics::NozzleXY at_begin = nozzle_.nozzle();
  const planner::PlannedMove& last = run.moves.back();
  nozzle_.set(run.ends_run() ? at_rest(last.segment.end_mm, model) : at_end_of(last, model),
              last.segment.end_mm);
  return at_begin;
}

// Why the run cannot be worked out; empty if it can.
std::string Admission::refusal(const RunJob& job, double asked_accel_mm_s2) const {
  if (job.piece.cut_off) {
    return "too many lines without motion stand in a row in the middle of the motion";
  }
  const double accel = largest_motor_accel(job.piece.moves, job.rules->verify.fixed.motors);
  const double most_mm_s2 = rules_->settings.base_max_accel_mm_s2(asked_accel_mm_s2);
  if (accel > kRounding * most_mm_s2) {
    return fmt::format(
        "the plan itself accelerates a motor by {:.0f} mm/s², more than base.max_accel_mm_s2, "
        "{:.0f}; raise that if the motors can",
        accel, most_mm_s2);
  }
  if (job.grid.count > kMaxRunNodes) {
    return fmt::format("{:.0f} s of motion without a stop are too long to be handled",
                       static_cast<double>(job.grid.count) * job.setup.period_s);
  }
  return {};
}

// Tells once that the base cannot follow what the print asks as well as the motors could.
void Admission::warn_if_capped(const RunSetup& setup, const Piece& piece) {
  // Below this many times the plan's acceleration the error grows.
  constexpr double kEnough = 2.0;
  const double wanted_mm_s2 =
      std::min(kEnough * setup.asked_accel_mm_s2,
               rules_->settings.base_max_accel_mm_s2(setup.asked_accel_mm_s2));
  if (told_of_cap_ || wanted_mm_s2 <= setup.accel_by_lines_mm_s2) {
    return;
  }
  told_of_cap_ = true;
  report_->warnings.push_back(to_string(Diagnostic{
      {input_name_, piece.events.front().line.number},
      fmt::format("the print asks for {:.0f} mm/s² here, and emit.max_speed_step_mm_s and "
                  "emit.max_lines_per_s allow the motors no more than {:.0f}; raise the first "
                  "if the motors can do more",
                  setup.asked_accel_mm_s2, setup.accel_by_lines_mm_s2)}));
}

// The objections for which earlier passes blamed the run.
std::vector<std::string> Admission::blamed_before(const Piece& piece) const {
  const std::size_t first = piece.moves.front().segment.line;
  const std::size_t last = piece.moves.back().segment.line;
  std::vector<std::string> reasons;
  for (const verify::BlamedRun& run : *kept_) {
    if (run.first_line <= last && first <= run.last_line) {
      reasons.push_back(run.reason);
    }
  }
  return reasons;
}

}  // namespace unflex::run
