#include "run_writer.hpp"

#include <cmath>
#include <utility>

#include "judge.hpp"
#include "nozzle_motion.hpp"

namespace unflex::pipeline {
namespace {

constexpr std::size_t kMostListed = 1000;
// Of the tolerance, for a run that the whole of it spoils.
constexpr double kFineTolerance = 0.05;
// Of the limits, for a run that exceeds them.
constexpr double kLower = 0.85;
constexpr double kApart_mm = 1e-3;

// How differently two nozzles swing.
double apart_mm(const dynamics::NozzleXY& a, const dynamics::NozzleXY& b,
                const verify::NozzleModel& model) {
  const auto on_axis = [](const dynamics::NozzleState& from, const dynamics::NozzleState& to,
                          const dynamics::FlexibleAxis& axis) {
    return std::hypot(from.position - to.position,
                      (from.velocity - to.velocity) / axis.omega_rad_s);
  };
  return std::hypot(on_axis(a.x, b.x, model.x), on_axis(a.y, b.y, model.y));
}

}  // namespace

RunWriter::RunWriter(const RunRules& rules, double max_lines_per_s, report::Report& report)
    : rules_(&rules), max_lines_per_s_(max_lines_per_s), report_(&report), emitter_(rules.emit) {}

std::string RunWriter::write(const RunJob& job) {
  const Piece& piece = job.piece;
  std::string text;
  if (!piece.is_run) {
    for (const gcode::Event& event : piece.events) {
      emitter_.line(event, text);
    }
    keep_motion(piece);
  } else if (std::optional<std::string> failure = write_run(job, text)) {
    text.clear();
    emitter_.keep(piece.events, text);
    keep_motion(piece);
    note_fallback(job, std::move(*failure));
  }
  return text;
}

std::string RunWriter::finish() {
  std::string text;
  emitter_.finish(text);
  report_->line_budget.max_lines_per_s = max_lines_per_s_;
  report_->line_budget.cost_rms_mm = cost_.rms_mm();
  report_->line_budget.cost_max_mm = cost_.max_mm();
  return text;
}

// The printer moves as the input has it.
void RunWriter::keep_motion(const Piece& piece) {
  nozzle_ = after_motion(piece, nozzle_, rules_->verify.nozzle);
  line_rate_.change_text();
  line_rate_.forget();
  for (const planner::PlannedMove& move : piece.moves) {
    line_rate_.add(move);
  }
  const double kept_s = planner::duration_s(piece.moves);
  sliced_s_ += kept_s;
  written_s_ += kept_s;
  note_lines_above_budget(piece);
}

void RunWriter::note_lines_above_budget(const Piece& piece) {
  if (line_rate_.max_per_s() <= max_lines_per_s_) {
    return;
  }
  report::LineBudget& budget = report_->line_budget;
  ++budget.places_above;
  if (budget.above.size() < kMostListed) {
    budget.above.push_back({piece.events.front().line.number, piece.events.back().line.number,
                            line_rate_.max_per_s()});
  }
}

// The run as compensated text, or why its original lines must stand.
std::optional<std::string> RunWriter::write_run(const RunJob& job, std::string& text) {
  if (!job.failure.empty()) {
    return job.failure;
  }
  // Its own moves would find the nozzle as it is, which after motion that was kept is not as
  // reckoned with.
  before_ = apart_mm(nozzle_, job.nozzle, rules_->verify.nozzle) > kApart_mm
                ? deviation_of(job.piece.moves, job.piece.moves, nozzle_, rules_->verify, 0.0)
                : job.before;
  const auto plan = [&](double tolerance_share, double limits_share) {
    return emit::plan_run(job.run(tolerance_share, limits_share, line_rate_.last_begins_s()),
                          emitter_.run_start(), rules_->emit);
  };
  const bool counts_steps = rules_->emit.lines.burst_lines > 0;
  std::optional<std::string> objection = "planned for another start";
  if (job.plan.start == emitter_.run_start()) {
    objection = try_run(job, job.plan, text);
  }
  // What was not known beforehand: how it starts, and the lines before.
  if (objection && (counts_steps || job.plan.start != emitter_.run_start())) {
    objection = try_run(job, plan(1.0, 1.0), text);
  }
  // Where whole steps make a line too quick or the lines a few too many, aiming lower helps.
  if (objection && counts_steps) {
    objection = try_run(job, plan(1.0, kLower), text);
  }
  // Where long lines break a limit or cost too much, short ones may do.
  return objection ? try_run(job, plan(kFineTolerance, 1.0), text) : objection;
}

std::optional<std::string> RunWriter::try_run(const RunJob& job, const emit::RunPlan& plan,
                                              std::string& text) {
  if (plan.empty()) {
    return "the motion is too small to be written";
  }
  emit::Emitter trial = emitter_;
  text.clear();
  trial.run(job.run(), plan, text);
  Verdict verdict =
      judge(job.piece.moves, before_, text, emitter_.printer(), emitter_.printer_limits(), nozzle_,
            rules_->verify, line_rate_, max_lines_per_s_);
  if (verdict.objection) {
    return std::move(verdict.objection);
  }
  sliced_s_ += planner::duration_s(job.piece.moves);
  written_s_ += planner::duration_s(verdict.replayed);
  cost_.add(job.piece.moves, job.setup.lead_in_s, job.base, verdict.replayed, nozzle_,
            rules_->verify.nozzle);
  nozzle_ = verdict.nozzle;
  line_rate_ = std::move(verdict.rate);
  note_lines_above_budget(job.piece);
  emitter_ = std::move(trial);
  ++report_->runs_compensated;
  report_->windows_solved += job.spans.size();
  return std::nullopt;
}

void RunWriter::note_fallback(const RunJob& job, std::string reason) {
  ++report_->runs_fallback;
  report_->windows_fallback += job.spans.size();
  if (report_->fallbacks.size() < kMostListed) {
    report_->fallbacks.push_back({job.piece.events.front().line.number,
                                  job.piece.events.back().line.number, std::move(reason)});
  }
}

}  // namespace unflex::pipeline
