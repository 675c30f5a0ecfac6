#include "unflex/run/run_writer.hpp"

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "unflex/core/math.hpp"
#include "unflex/run/judge.hpp"

namespace unflex::run {
namespace {

constexpr std::size_t kMostListed = 1000;
// Share of the tolerance, for a run that fails with all of it.
constexpr double kFineTolerance = 0.05;
// Shares of the limits to aim at, for a run that exceeds them, and for a part that must be written.
constexpr double kLower[] = {0.85, 0.7};
constexpr double kLowest[] = {0.7, 0.5};
// The lines of this last stretch of a part decide how the printer arrives at the next part.
constexpr double kLastLines_s = 0.05;
constexpr double kApart_mm = 1e-3;
constexpr std::ptrdiff_t kKeptLines = 16;
// A part that begins less late than this is written as planned.
constexpr double kLate_s = 2e-5;
constexpr double kSamePlace_mm = 1e-7;

std::vector<gcode::Segment> last_lines(const std::vector<planner::PlannedMove>& moves) {
  std::vector<gcode::Segment> lines;
  for (const planner::PlannedMove& move : planner::last_moves(moves, kLastLines_s)) {
    lines.push_back(move.segment);
  }
  return lines;
}

// Adds the piece's lines to the kept lines; only the last ones since a stop are held.
void follow_motion(const Piece& piece, std::vector<gcode::Segment>& lines) {
  for (const gcode::Event& event : piece.events) {
    if (event.kind == gcode::EventKind::barrier) {
      lines.clear();
    }
    lines.insert(lines.end(), event.segments.begin(), event.segments.end());
    if (std::ssize(lines) > kKeptLines) {
      lines.erase(lines.begin(), lines.end() - kKeptLines);
    }
  }
}

}  // namespace

RunWriter::RunWriter(const RunRules& rules, std::string input_name, double max_lines_per_s,
                     report::Report& report)
    : is_robust_(rules.setup.is_robust()),
      input_name_(std::move(input_name)),
      max_lines_per_s_(max_lines_per_s),
      report_(&report),
      emitter_(rules.emit),
      nozzle_(rules.verify.nozzle, rules.verify.fixed, emitter_.printer().state().shaper),
      path_(rules.emit.fixed.firmware) {}

Result<RunWriter::Written> RunWriter::write(const RunJob& job, const RunJob* tried) {
  if (!job.piece.is_run) {
    if (job.rules) {
      nozzle_.set_model(job.rules->verify.nozzle);  // of another tool
    }
    return keep_lines(job.piece);
  }
  if (tried == nullptr) {
    begin(job);
  }
  std::string text;
  std::optional<std::string> objection = write_present(job, tried, text);
  if (!objection) {
    note_timing(job);
    path_.compensate(job.piece);
    return text;
  }
  if (const std::optional<Try> next = next_try(job, *objection)) {
    return *next;
  }
  return write_as_sliced(job, std::move(*objection));
}

// The lines between runs.
std::string RunWriter::keep_lines(const Piece& piece) {
  std::string text;
  for (const gcode::Event& event : piece.events) {
    emitter_.line(event, text);
  }
  path_.keep(piece);
  keep_motion(piece);
  return text;
}

// The run, or part of a run, is at hand from now on.
void RunWriter::begin(const RunJob& job) {
  const Piece& piece = job.piece;
  if (piece.begins_run()) {
    last_lines_.clear();
    late_s_ = 0.0;
    run_stands_ = false;
    run_line_ = piece.moves.front().segment.line;
  }
  tries_.reset();
  nozzle_.set_model(job.rules->verify.nozzle);
  NozzleFollower at_run = nozzle_;
  switching_s_ = at_run.begin_run(piece);
  run_nozzle_ = at_run.nozzle();
}

// Writes the run at hand, or `tried` in its place. Returns why it cannot be written, if so.
std::optional<std::string> RunWriter::write_present(const RunJob& job, const RunJob* tried,
                                                    std::string& text) {
  if (run_stands_) {
    return "the run's beginning stands as it is";
  }
  if (tried == nullptr) {
    return write_run(job, text);
  }
  if (tries_->present().remedy == Remedy::scaled && !tried->retimed) {
    return "no faster timing was found";
  }
  return write_run(*tried, text);
}

// What to try next after this objection, if there is anything. Otherwise the objection becomes the
// one for which the sliced lines stand.
std::optional<Try> RunWriter::next_try(const RunJob& job, std::string& objection) {
  if (run_stands_) {
    return std::nullopt;
  }
  if (!tries_) {
    tries_ = Tries(job, objection, job.rules->emit.lines.burst_lines > 0);
  }
  const std::optional<Try> next = tries_->next();
  if (next && next->remedy == Remedy::as_sliced) {
    note_slow(job, tries_->objection());
  } else if (!next && tries_->has_given() && tries_->present().remedy == Remedy::reserve) {
    objection = tries_->objection();
  }
  return next;
}

// The run at hand is written: tells what its timing is, if it is not the one that was asked for.
void RunWriter::note_timing(const RunJob& job) {
  if (!tries_) {
    if (job.keeps_timing()) {
      note_slow(job, job.slow_reason);
    } else if (!job.scaled_reason.empty()) {
      note_scaled(job, job.scaled_reason);
    }
  } else if (tries_->present().remedy == Remedy::scaled && job.has_base()) {
    note_scaled(job, tries_->objection());
  }
}

// The run at hand cannot be compensated: its original lines stand, if they can.
Result<std::string> RunWriter::write_as_sliced(const RunJob& job, std::string failure) {
  const Piece& piece = job.piece;
  const bool in_motion = !last_lines_.empty();
  const bool begins_long_run = piece.begins_run() && !piece.ends_run();
  std::string text;
  if (in_motion || begins_long_run) {
    // If the first part of a long run stood as sliced, all behind it would have to. In the middle
    // of the motion there is no way back to the sliced lines at all.
    std::optional<std::string> objection = insist(job, text);
    if (!objection) {
      path_.compensate(piece);
      return text;
    }
    failure = std::move(*objection);
  }
  if (in_motion) {
    const std::size_t line = piece.events.front().line.number;
    blocked_ = {run_line_, piece.moves.back().segment.line,
                fmt::format("at line {}: {}", line, failure)};
    return fail(ErrorKind::input, {input_name_, line},
                fmt::format("the lines up to {} cannot be compensated, and the print does not stop "
                            "before them: {}; write to a file instead of a stream, then unflex "
                            "can leave the whole motion as it was sliced",
                            piece.events.back().line.number, failure));
  }
  text.clear();
  emitter_.keep(piece.events, text);
  path_.keep(piece);
  keep_motion(piece);
  note_fallback(job, std::move(failure));
  run_stands_ = true;
  return text;
}

std::string RunWriter::finish() {
  std::string text;
  emitter_.finish(text);
  report_->shaper_left_off = emitter_.shaper_left_off();
  report_->extruded_path = path_.path();
  report_->unknown_commands = path_.unknown_commands();
  report_->line_budget.max_lines_per_s = max_lines_per_s_;
  report_->line_budget.cost_rms_mm = emission_.rms_mm();
  report_->line_budget.cost_max_mm = emission_.max_mm;
  if (is_robust_) {
    report_->others.robustness = {robust_.rms_mm(), nominal_.rms_mm()};
  }
  return text;
}

// Accounts for a kept piece: the printer moves as sliced.
void RunWriter::keep_motion(const Piece& piece) {
  written_s_ += nozzle_.follow(piece);
  follow_motion(piece, kept_lines_);
  if (!piece.moves.empty()) {
    machine_mm_ = piece.moves.back().segment.end_mm;
  }
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

emit::RunPlan RunWriter::plan(const RunJob& job, double tolerance_share,
                              double limits_share) const {
  emit::Run run = job.run(tolerance_share, limits_share, line_rate_.last_begins_s());
  run.from_mm = xy_of(emitter_.printer().state().position_mm);
  run.late_s = late_s_;
  run.kept_before = kept_before(job);
  return emit::plan_run(run, emitter_.run_start(), job.rules->emit);
}

// The kept motion before a run, where the firmware would otherwise wait for a first step. Behind a
// kept line in X and Y the emitter stops the machine.
std::optional<gcode::Segment> RunWriter::kept_before(const RunJob& job) const {
  if (!job.piece.begins_run() || kept_lines_.empty() || kept_lines_.back().moves_xy() ||
      job.rules->emit.lines.first_step_s <= 0.0) {
    return std::nullopt;
  }
  return kept_lines_.back();
}

// The lines that were prepared, retimed if the part begins late or behind kept motion.
emit::RunPlan RunWriter::in_time(const RunJob& job) const {
  const std::optional<gcode::Segment> before = kept_before(job);
  if ((std::abs(late_s_) < kLate_s && !before) || job.plan.empty()) {
    return job.plan;
  }
  emit::Run run = job.run();
  run.late_s = late_s_;
  run.kept_before = before;
  return emit::retimed(job.plan, run, job.rules->emit);
}

// Whether the run was planned for the place and state in which the printer is.
bool RunWriter::fits(const RunJob& job) const {
  const gcode::Position& at = emitter_.printer().state().position_mm;
  const bool same_place =
      job.piece.begins_run() || math::hypot(job.plan.from_mm[0] - at[gcode::X],
                                            job.plan.from_mm[1] - at[gcode::Y]) < kSamePlace_mm;
  return same_place && job.plan.start == emitter_.run_start();
}

// Writes the run as compensated text, or returns why its original lines must stand.
std::optional<std::string> RunWriter::write_run(const RunJob& job, std::string& text) {
  if (!job.failure.empty()) {
    return job.failure;
  }
  // The sliced moves would start with the true nozzle. If an earlier run was kept, that nozzle is
  // not the expected one, and the deviation has to be measured again.
  before_ = verify::apart_mm(run_nozzle_, job.nozzle, job.rules->verify.nozzle) > kApart_mm
                ? deviation_as_sliced(job.piece, run_nozzle_, job.rules->verify)
                : job.before;
  const bool counts_steps = job.rules->emit.lines.burst_lines > 0;
  std::optional<std::string> objection = "planned for another start";
  if (fits(job)) {
    objection = try_run(job, in_time(job), false, text);
  }
  // Plans again with what was not known before: how the run starts, and the lines before it.
  if (objection && (counts_steps || !fits(job))) {
    objection = try_run(job, plan(job, 1.0, 1.0), false, text);
  }
  // Lines that end on whole steps may be too quick, or a few too many. So may lines for a free
  // timing, which takes all that the motors give. Aiming at lower limits helps, but lines whose
  // limits are below their base's follow the base worse. Then a base that does less helps.
  for (const double share : kLower) {
    const bool breaks_limit = objection && !objection->starts_with(kWorse);
    if (objection && ((counts_steps && breaks_limit) || job.retimed)) {
      objection = try_run(job, plan(job, 1.0, share), false, text);
    }
  }
  // If long lines break a limit or cost too much, short ones may do.
  return objection ? try_run(job, plan(job, kFineTolerance, 1.0), false, text) : objection;
}

// Writes a part that must be written: it may be a little worse, but must keep the limits. Returns
// why it cannot be written, if so.
std::optional<std::string> RunWriter::insist(const RunJob& job, std::string& text) {
  if (!job.failure.empty()) {
    return job.failure;
  }
  std::optional<std::string> objection = try_run(job, plan(job, 1.0, 1.0), true, text);
  for (const double share : kLowest) {
    if (objection) {
      objection = try_run(job, plan(job, 1.0, share), true, text);
    }
  }
  return objection;
}

std::optional<std::string> RunWriter::try_run(const RunJob& job, const emit::RunPlan& plan,
                                              bool may_be_worse, std::string& text) {
  if (plan.empty()) {
    return "the motion is too small to be written";
  }
  const Piece& piece = job.piece;
  emit::Emitter trial = emitter_;
  text.clear();
  trial.run(job.run(), plan, text);
  Verdict verdict =
      judge(piece, job.reference(), before_, text, emitter_.printer(), emitter_.printer_limits(),
            run_nozzle_, job.rules->verify, job.lead_in_s(), line_rate_, max_lines_per_s_,
            {piece.begins_run() ? kept_lines_ : last_lines_, !piece.ends_run(), may_be_worse,
             machine_mm_});
  if (verdict.objection) {
    return std::move(verdict.objection);
  }
  if (verdict.worse) {
    report_->warnings.push_back(to_string(
        Diagnostic{{input_name_, piece.events.front().line.number},
                   fmt::format("up to line {}, in a part of a long run, the nozzle strays more "
                               "than it would without compensation",
                               piece.events.back().line.number)}));
  }
  sliced_s_ += planner::duration_s(piece.moves);
  written_s_ += planner::duration_s(verdict.replayed) + switching_s_;
  add_emission_error({job.reference(), job.lead_in_s(), job.base, run_nozzle_}, verdict.replayed,
                     verdict.wait_s, job.rules->verify.nozzle, emission_);
  robust_.add(job.robustness.robust);
  nominal_.add(job.robustness.nominal);
  late_s_ += planner::duration_s(verdict.replayed) - planner::duration_s(job.reference()) -
             job.lead_in_s() - verdict.wait_s;
  last_lines_ = piece.ends_run() ? std::vector<gcode::Segment>() : last_lines(verdict.replayed);
  kept_lines_.clear();
  if (!verdict.replayed.empty()) {
    machine_mm_ = verdict.replayed.back().segment.end_mm;
  }
  static_cast<void>(nozzle_.begin_run(piece));
  nozzle_.set(verdict.nozzle, piece.moves.back().segment.end_mm);
  line_rate_ = std::move(verdict.rate);
  note_lines_above_budget(piece);
  emitter_ = std::move(trial);
  report_->runs.compensated += piece.begins_run() ? 1 : 0;
  report_->runs.windows_solved += compensate::windows_to_solve(job.windows.spans);
  return std::nullopt;
}

void RunWriter::note_scaled(const RunJob& job, std::string reason) {
  note_stretch(job, std::move(reason), report_->free_timing.pieces_scaled,
               report_->free_timing.scaled);
}

void RunWriter::note_slow(const RunJob& job, std::string reason) {
  note_stretch(job, std::move(reason), report_->free_timing.pieces_as_sliced,
               report_->free_timing.as_sliced);
}

void RunWriter::note_stretch(const RunJob& job, std::string reason, std::size_t& count,
                             std::vector<report::Fallback>& list) {
  ++count;
  if (list.size() < kMostListed) {
    list.push_back({job.piece.events.front().line.number, job.piece.events.back().line.number,
                    std::move(reason)});
  }
}

void RunWriter::note_fallback(const RunJob& job, std::string reason) {
  report_->runs.fallback += job.piece.begins_run() ? 1 : 0;
  report_->runs.windows_fallback += compensate::windows_to_solve(job.windows.spans);
  if (report_->runs.fallbacks.size() < kMostListed) {
    report_->runs.fallbacks.push_back({job.piece.events.front().line.number,
                                       job.piece.events.back().line.number, std::move(reason)});
  }
}

}  // namespace unflex::run
