#include "verifier.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/verify/endless.hpp"

namespace unflex::verify {
namespace {

// How far a line inside a compensated run may stand from its place, at least. The base leads the
// nozzle by up to a/ω² when it accelerates, and a line can only stand between two lines of motion.
constexpr double kLeastPlaceTolerance_mm = 0.5;
constexpr std::size_t kMovesPerUpdate = 1024;
// How far the clock of a run may lag at the end of its plan, besides the lag that is measured.
constexpr double kLate_s = 5e-4;
constexpr double kRingsFor_s = 1.0;

double place_tolerance_mm(const Rules& rules, double base_max_accel_mm_s2) {
  const double omega = dynamics::slowest_rad_s(rules.nozzle);
  return std::max(kLeastPlaceTolerance_mm, base_max_accel_mm_s2 / (omega * omega)) +
         0.5 * rules.base_max_velocity_mm_s / rules.max_lines_per_s;
}

// Length of a seekable stream in bytes, otherwise 0.
double stream_bytes(std::istream& stream) {
  const std::istream::pos_type here = stream.tellg();
  if (here == std::istream::pos_type(-1)) {
    stream.clear();
    return 0.0;
  }
  stream.seekg(0, std::ios::end);
  const auto length = static_cast<double>(stream.tellg() - here);
  stream.seekg(here);
  return length;
}

}  // namespace

ReadingProgress::ReadingProgress(Progress& progress, std::istream& output)
    : progress_(&progress), bytes_(stream_bytes(output)) {}

bool ReadingProgress::count_move() { return ++moves_ % kMovesPerUpdate == 0; }

void ReadingProgress::tell(double bytes_read) {
  progress_->update("verifying", bytes_ > 0.0 ? std::min(1.0, bytes_read / bytes_) : -1.0);
}

Verifier::Verifier(std::istream& input, const std::string& input_name, std::istream& output,
                   const std::string& output_name, const Rules& rules, Progress& progress,
                   const Observation& observation)
    : rules_(rules),
      tools_(rules, observation),
      progress_(progress, output),
      observer_(observation.observer),
      violations_(input_name, output_name),
      input_(input, input_name, rules_,
             rules.approaches ? ReplayedFile::sliced_with_approaches : ReplayedFile::sliced,
             [this](const gcode::Line& line) {
               if (observer_ != nullptr) {
                 observer_->line(line);
               }
             }),
      output_(output, output_name, rules_, ReplayedFile::emitted, {}),
      lines_(input_.replay(), output_.replay(), violations_, rules.may_ask_ahead),
      paths_(
          {.sliced = [this](planner::PlannedMove& move) { return next_input_move(move); },
           .resting = [this](planner::PlannedMove& move) { return next_resting_move(move); },
           .output = [this](OutputMove& move) { return next_output_move(move); },
           .on_planned =
               [this](const planner::PlannedMove& move) { flow_difference_.play_sliced(move); }}),
      original_(rules.nozzle, observation, NozzleBase::sliced, tools_.longest_reach_s()),
      kept_(coarse(rules.nozzle), {}, tools_.longest_reach_s()),
      emitted_(rules.nozzle, observation, NozzleBase::emitted, tools_.longest_reach_s()),
      run_steps_(rules.fixed, rules.steps),
      base_(rules_, violations_),
      rules_of_run_(rules_, violations_) {
  original_.follow_line(rules.line);
  emitted_.follow_line(rules.line);
}

Result<VerifyReport> Verifier::verify() {
  for (;;) {
    play_run();
    for (const Track* const file : {&input_, &output_}) {
      if (file->replay().error()) {
        return tl::unexpected(*file->replay().error());
      }
    }
    if (failure_) {
      return tl::unexpected(*failure_);
    }
    if (progress_.cancelled()) {
      return fail(ErrorKind::internal, "cancelled");
    }
    input_.replay().next_section();
    output_.replay().next_section();
    if (!sections_agree() || input_.section().kind == SectionKind::end) {
      break;
    }
    play_kept_line();
    if (failure_) {
      return tl::unexpected(*failure_);
    }
    input_.replay().next_section();
    output_.replay().next_section();
  }
  hold();
  return report();
}

bool Verifier::next_input_move(planner::PlannedMove& move) {
  if (failure_ || !input_.replay().next(move) || ends_here(move, input_)) {
    return false;
  }
  input_.play(move, move);
  return true;
}

bool Verifier::next_resting_move(planner::PlannedMove& move) {
  if (failure_ || !input_.replay().next_resting(move) || ends_here(move, input_)) {
    return false;
  }
  rules_of_run_.add_sliced(move);
  base_.add_planned(move);
  violations_.add_to_run(move.segment.line);
  return true;
}

bool Verifier::next_output_move(OutputMove& move) {
  planner::PlannedMove played;
  if (!output_.replay().next(played)) {
    return false;
  }
  move = output_filament_.laid(std::move(played));
  return true;
}

// Whether the verification ends here because the move is endless.
bool Verifier::ends_here(const planner::PlannedMove& move, const Track& file) {
  if (is_endless(move)) {
    failure_ = endless_move(move, file.replay().reader().name());
  }
  return failure_.has_value();
}

void Verifier::begin_paths(bool compensated) {
  if (!compensated) {
    paths_.begin_kept();
    return;
  }
  const bool is_free = output_.section().has_free_timing;
  const double lead_in_s = is_free ? 0.0
                                   : output_.section().lead_in_s +
                                         planner::wait_s(output_.replay().front(), rules_.fixed);
  const bool is_played_as_planned = spec_of(rules_.fixed.firmware).motion.plays_as_planned;
  paths_.begin_run(is_free                ? Timing::free
                   : is_played_as_planned ? Timing::planned
                                          : Timing::unplanned,
                   lead_in_s, owed_filament_mm());
  if (!is_free) {
    flow_difference_.begin_run(lead_in_s);
  }
}

// Mass and height are in a move as where the move begins.
template <class Hung>
void Verifier::change_machine(const planner::PlannedMove& move, Hung& nozzles) const {
  if (rules_.change.acts()) {
    nozzles.set_machine(rules_.change, move.segment.start_mm);
  }
}

void Verifier::begin_section(bool compensated) {
  follow_tool();
  rate_.forget();
  base_.begin_run();
  run_steps_.clear();
  rules_of_run_.begin(rate_, since_kept_motion_s_ < kRingsFor_s,
                      compensated && output_.section().has_free_timing);
  begin_paths(compensated);
  follow_pressure(compensated);
  shape_sliced();
  for_sliced([&](Nozzles& nozzles) { nozzles.begin_section(paths_.sliced()); });
  if (compensated) {
    // A run begins at rest, and it has a clock of its own.
    emitted_.finish();
    violations_.begin_run();
  }
  shape_emitted();
  emitted_.begin_section(paths_.emitted());
  if (compensated) {
    const Meter& emitted = emitted_.main();
    kept_.begin_section(paths_.kept());
    kept_.set_state(emitted.nozzle(), emitted.base_mm());
    kept_.skip(paths_.kept_lead_in_s());
  }
  if (observer_ != nullptr) {
    observer_->section(paths_.sliced(), paths_.emitted());
  }
  filament_.begin_run(paths_.emitted());
  laying_checked_ = false;
  input_.begin_section();
  output_.begin_section();
  if (compensated) {
    // Both nozzles begin with the same swing. If it were sampled only later, it might seem smaller.
    kept_.look();
  }
}

// By how much the filament of a run of free timing may be off in the end. A firmware that lays
// filament in steps may owe some.
double Verifier::owed_filament_mm() const {
  constexpr double kOwedSteps = 1.5;
  return spec_of(rules_.fixed.firmware).motion.rounds_to_steps
             ? kOwedSteps / rules_.fixed.steps_per_mm[gcode::E]
             : filament_tolerance_mm();
}

void Verifier::play_run() {
  skip_added_barriers();
  const bool compensated = output_.replay().has_move() && output_.section().compensated;
  begin_section(compensated);
  if (!compensated && input_.replay().has_move() && output_.replay().has_move()) {
    check_regime(input_.section(), output_.section());
  }
  if (compensated) {
    const gcode::ModalState& modal = output_.section().regime->modal;
    // A macro may have switched on a shaper that nobody has told of.
    const gcode::InterpreterOptions& told = rules_.interpreter;
    const bool is_touched =
        any_axis(std::logical_and<>{}, modal.shaper_touched, told.shaper_unknown);
    if (modal.shaper.is_on() || modal.shaper.is_unknown() || is_touched) {
      violations_.in_output(output_.section().line.number,
                            "the printer's input shaper is on in a compensated run");
    }
  }
  emitted_.follow_lag(compensated);
  emitted_.follow_feed(compensated && output_.section().has_free_timing);
  totals_.runs += compensated ? 1 : 0;
  play_run_moves(compensated);
  emitted_.follow_lag(false);
  if (failure_ || progress_.cancelled()) {
    return;
  }
  end_section();
  filament_.end_run();
  compare_lines(true);
  check_run(compensated);
}

// unflex stops the machine before a run to set it up; the sliced file has no such stop.
void Verifier::skip_added_barriers() {
  Replay& output = output_.replay();
  while (!output.has_move() && output.following().may_be_added &&
         (input_.replay().has_move() ||
          !same_line(input_.replay().following().line, output.following().line))) {
    join_over_barrier();
  }
}

// Joins the run over a barrier. The machine stands still there, since unflex switches its shaper.
void Verifier::join_over_barrier() {
  const double switching_s = output_.rest_of_following_s();
  emitted_.hold(switching_s);
  output_.rest(switching_s);
  since_kept_motion_s_ += switching_s;
  output_.replay().join_over_barrier();
}

void Verifier::shape_sliced() {
  static_cast<void>(input_.replay().has_move());  // so that the regime of a run is known
  if (!input_.takes_shaper()) {
    return;
  }
  const planner::Shaping shaping = planner::shaping(rules_.fixed, input_.shaper());
  if (shaping.acts() && !unshaped_) {
    unshaped_ = original_;
    unshaped_->main().drop_line();  // its line of plastic is not reported
    unshaped_->watch_as(NozzleBase::unshaped);
    if (observer_ == nullptr || !observer_->asks_for_unshaped()) {
      unshaped_->drop_detuned();
    }
    original_.watch_as(NozzleBase::shaped);
  }
  original_.shape(shaping);
}

// If the settings give no pressure advance, the hotend is taken to need the sliced file's.
dynamics::HotendPressure Verifier::hotend() const {
  dynamics::HotendPressure hotend = rules_.line.hotend;
  if (hotend.advance_s == 0.0) {
    hotend.advance_s = advance_of(input_.section()).advance_s;
  }
  return hotend;
}

planner::FirmwareAdvance Verifier::advance_of(const Section& section) const {
  return planner::advance_in_force(rules_.fixed, section.advance);
}

void Verifier::set_pressure(Nozzles& nozzles, const Section& section) const {
  if (section.regime && input_.section().regime) {
    nozzles.main().line()->set(hotend(), advance_of(section));
  }
}

// Sets by either file's section how its filament is pressed in the hotend.
void Verifier::follow_pressure(bool compensated) {
  static_cast<void>(input_.replay().has_move());  // so that the regime of a run is known
  set_pressure(original_, input_.section());
  set_pressure(emitted_, output_.section());
  if (compensated && rules_.line.is_written && advance_of(output_.section()).advance_s == 0.0 &&
      hotend().advance_s > 0.0) {
    output_filament_.begin_written(hotend());
  } else {
    output_filament_.begin_plain();
  }
}

void Verifier::shape_emitted() {
  if (output_.takes_shaper()) {
    emitted_.shape(planner::shaping(rules_.fixed, output_.shaper()));
  }
}

void Verifier::play_run_moves(bool compensated) {
  OutputMove move;
  for (;;) {
    if (paths_.next_output(move)) {
      if (ends_here(move.pushed, output_)) {
        return;
      }
      play(move);
      if (compensated) {
        base_.add(move.pushed);
        run_steps_.play(move.pushed);
      } else {
        base_.add_kept(move.pushed);
      }
      if (progress_.count_move()) {
        compare_lines(false);
        progress_.tell(static_cast<double>(output_.replay().reader().bytes_read()));
        if (progress_.cancelled()) {
          return;
        }
      }
      continue;
    }
    if (!output_.replay().following().may_be_added) {
      return;
    }
    // After a run unflex stops the machine once more.
    finish_reference();
    if (same_line(input_.replay().following().line, output_.replay().following().line)) {
      return;
    }
    join_over_barrier();
    // Reads on, so that the regime of the next part is known.
    static_cast<void>(output_.replay().has_move());
    set_pressure(emitted_, output_.section());
  }
}

void Verifier::play(const OutputMove& output) {
  const planner::PlannedMove& move = output.pushed;
  rate_.add(move);
  const double start_s = emitted_.plan_time_s();
  const bool compensated = paths_.is_run();
  const bool late = paths_.emitted().section_complete() &&
                    start_s >= paths_.emitted().end_s() + kLate_s + emitted_.main().lag_s();
  since_kept_motion_s_ += move.duration_s();
  if (!compensated && move.segment.extruding() && !laying_checked_) {
    check_advance(false, move.segment.line);
    laying_checked_ = true;
  }
  if (!compensated && move.segment.length_xy_mm() > 0.0) {
    since_kept_motion_s_ = 0.0;
  }
  change_machine(move, emitted_);
  emitted_.play(output.laid, move);
  filament_.play(output.laid, start_s);
  if (compensated) {
    rules_of_run_.add(output.laid, emitted_.main(), late,
                      paths_.is_free() ? owed_filament_mm() : filament_tolerance_mm());
  }
  output_.play(move, output.laid);
  if (compensated && !paths_.is_free()) {
    flow_difference_.play_output(output.laid);
  }
  let_original_follow(paths_.sliced_until_s(emitted_.plan_time_s()));
}

void Verifier::let_original_follow(double until_s) {
  while (const std::optional<planner::PlannedMove> move = paths_.next_sliced(until_s)) {
    for_sliced([&](Nozzles& nozzles) {
      change_machine(*move, nozzles);
      nozzles.play(*move);
    });
  }
  double needed_s = original_.main().time_s();
  if (observer_ != nullptr) {
    observer_->advanced(paths_.sliced(), needed_s);
    needed_s -= observer_->memory_s();
  }
  const double emitted_s = emitted_.main().time_s();
  if (!paths_.is_run()) {
    needed_s = std::min(needed_s, emitted_s);
    input_.replay().skip_resting();
  } else {
    let_kept_follow(paths_.kept_until_s(emitted_.plan_time_s()));
  }
  const double emitted_reach_s = emitted_.main().reach_s();
  paths_.discard_before(
      needed_s - original_.main().reach_s(), emitted_s - emitted_reach_s,
      kept_.time_s() - (paths_.has_own_clock() ? kept_.reach_s() : emitted_reach_s));
}

void Verifier::let_kept_follow(double until_s) {
  while (const std::optional<planner::PlannedMove> move = paths_.next_kept(until_s)) {
    change_machine(*move, kept_);
    kept_.play(*move);
  }
}

void Verifier::end_section() {
  if (paths_.is_run()) {
    emitted_.finish();
  }
  emitted_.wait_for_reference();
  if (paths_.is_run()) {
    paths_.complete_kept();
    let_kept_follow(std::numeric_limits<double>::infinity());
    if (!paths_.is_free()) {
      flow_difference_.end_run();
    }
  }
  finish_reference();
  check_flow();
}

void Verifier::finish_reference() {
  ReferencePath& sliced = paths_.sliced();
  while (!sliced.section_complete()) {
    sliced.extend_to(sliced.end_s());
    let_original_follow(sliced.end_s());
  }
  let_original_follow(std::numeric_limits<double>::infinity());
}

void Verifier::play_kept_line() {
  begin_section(false);
  OutputMove move;
  while (next_output_move(move) && !ends_here(move.pushed, output_)) {
    play(move);
  }
  end_section();
  const double input_s = input_.rest_of_section_s();
  const double output_s = output_.rest_of_section_s();
  if (input_s > 0.0) {
    paths_.sliced().rest(input_s);
    input_.rest(input_s);
    for_sliced([&](Nozzles& nozzles) { nozzles.hold(input_s); });
    if (observer_ != nullptr) {
      observer_->hold(input_s);
    }
  }
  if (output_s > 0.0) {
    emitted_.hold(output_s);
    output_.rest(output_s);
    since_kept_motion_s_ += output_s;
  }
}

// After the end of the file the base is held: what the nozzle still does then counts as well.
void Verifier::hold() {
  begin_section(false);
  const double hold_s = rules_.nozzle.hold_s;
  paths_.sliced().hold(original_.plan_mm(), hold_s);
  const auto rest = [&](Nozzles& nozzles) {
    nozzles.play(resting(nozzles.plan_mm(), hold_s));
    nozzles.finish();
  };
  for_sliced(rest);
  rest(emitted_);
  input_.finish();
  output_.finish();
}

void Verifier::compare_lines(bool complete) {
  lines_.compare(complete, place_tolerance_mm(rules_, base_.accel_limit_mm_s2()));
}

}  // namespace unflex::verify
