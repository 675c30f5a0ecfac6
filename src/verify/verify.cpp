#include "unflex/verify/verify.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "unflex/verify/endless.hpp"
#include "verifier.hpp"

namespace unflex::verify {
namespace {

// How far a line inside a compensated run may stand from its place, at least. The base leads the
// nozzle by up to a/ω² when it accelerates, and a line can only stand between two lines of motion.
constexpr double kLeastPlaceTolerance_mm = 0.5;
constexpr std::size_t kMovesPerUpdate = 1024;
constexpr double kApart_s = 10.0;
// How far the clock of a run may lag at the end of its plan, besides the lag that is measured.
constexpr double kLate_s = 5e-4;
constexpr double kRingsFor_s = 1.0;

double place_tolerance_mm(const Rules& rules, double base_max_accel_mm_s2) {
  const double omega = std::min(rules.nozzle.x.slowest_rad_s(), rules.nozzle.y.slowest_rad_s());
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

// Makes `present` the shaper of the section. Returns whether it was another one.
bool takes_shaper(const Section& section, gcode::Shaper& present) {
  if (!section.regime) {
    return false;
  }
  const gcode::Shaper shaper = section.regime->modal.input_shaper();
  const bool differs = shaper.freq_x_hz != present.freq_x_hz ||
                       shaper.freq_y_hz != present.freq_y_hz || shaper.settings != present.settings;
  present = shaper;
  return differs;
}

Deviation deviation(const Meter& meter) { return {meter.extruding().stats(), meter.all().stats()}; }

}  // namespace

Verifier::Verifier(std::istream& input, const std::string& input_name, std::istream& output,
                   const std::string& output_name, const Rules& rules, Progress& progress,
                   const Observation& observation)
    : rules_(rules),
      progress_(&progress),
      observer_(observation.observer),
      output_bytes_(stream_bytes(output)),
      violations_(input_name, output_name),
      input_(input, input_name, rules.interpreter, rules.limits, rules.fixed,
             rules.approaches ? ReplayedFile::sliced_with_approaches : ReplayedFile::sliced),
      output_(output, output_name, rules.interpreter, rules.limits, rules.fixed,
              ReplayedFile::emitted),
      lines_(input_, output_, violations_, rules.may_ask_ahead),
      path_([this](ReferenceMove& next) { return next_input_move(next.move); }),
      run_path_([this](ReferenceMove& next) { return next_reference_move(next); }),
      resting_path_([this](ReferenceMove& next) { return next_kept_move(next.move); }),
      progress_timing_(
          [this](planner::PlannedMove& move) { return next_sliced_move(sliced_for_timing_, move); },
          [this](planner::PlannedMove& move) { return next_output_move_ahead(move); }),
      original_(rules.nozzle, observation, NozzleBase::sliced),
      kept_(coarse(rules.nozzle)),
      emitted_(rules.nozzle, observation, NozzleBase::emitted),
      input_flow_(rules.filament_area_mm2),
      output_flow_(rules.filament_area_mm2),
      input_steps_(rules.fixed, rules.steps),
      output_steps_(rules.fixed, rules.steps),
      run_steps_(rules.fixed, rules.steps),
      base_(rules_, violations_),
      rules_of_run_(rules_, violations_),
      input_excursion_(rules_.travel),
      output_excursion_(rules_.travel) {
  original_.follow_line(rules.line);
  emitted_.follow_line(rules.line);
  input_.on_line([this](const gcode::Line& line) {
    input_notes_.read(line);
    if (observer_ != nullptr) {
      observer_->line(line);
    }
  });
  output_.on_line([this](const gcode::Line& line) { output_notes_.read(line); });
}

Result<VerifyReport> Verifier::verify() {
  for (;;) {
    play_run();
    if (input_.error() || output_.error()) {
      return tl::unexpected(input_.error() ? *input_.error() : *output_.error());
    }
    if (failure_) {
      return tl::unexpected(*failure_);
    }
    if (progress_->cancelled()) {
      return fail(ErrorKind::internal, "cancelled");
    }
    input_.next_section();
    output_.next_section();
    if (!sections_agree() || input_.section().kind == SectionKind::end) {
      break;
    }
    play_kept_line();
    if (failure_) {
      return tl::unexpected(*failure_);
    }
    input_.next_section();
    output_.next_section();
  }
  hold();
  return report();
}

bool Verifier::next_input_move(planner::PlannedMove& move) {
  if (failure_ || !input_.next(move) || ends_here(move, input_)) {
    return false;
  }
  input_switching_.move();
  input_notes_.play(move.segment.line, totals_.reference_time_s);
  totals_.reference_time_s += move.duration_s();
  totals_.input_extrusion_mm += move.segment.delta(gcode::E);
  input_flow_.play(move);
  input_steps_.play(move);
  input_excursion_.add(move.segment);
  too_much_in_input_ = too_much_in_input_ || move.segment.too_much_filament;
  return true;
}

bool Verifier::next_resting_move(planner::PlannedMove& move) {
  if (failure_ || !input_.next_resting(move) || ends_here(move, input_)) {
    return false;
  }
  rules_of_run_.add_sliced(move);
  base_.add_planned(move);
  violations_.add_to_run(move.segment.line);
  return true;
}

// The next move of run_path_.
bool Verifier::next_reference_move(ReferenceMove& move) {
  if (has_free_timing()) {
    return progress_timing_.next(move);
  }
  if (!(has_own_clock() ? next_sliced_move(sliced_for_timing_, move.move)
                        : next_resting_move(move.move))) {
    return false;
  }
  flow_difference_.play_sliced(move.move);
  return true;
}

// The next move of resting_path_.
bool Verifier::next_kept_move(planner::PlannedMove& move) {
  if (!next_sliced_move(sliced_for_kept_, move)) {
    return false;
  }
  move = planner::as_played(std::move(move));
  return true;
}

// The next sliced move of a run that is kept on a clock of its own, for one of the two that ask for
// it.
bool Verifier::next_sliced_move(std::deque<planner::PlannedMove>& own, planner::PlannedMove& move) {
  if (own.empty()) {
    if (!next_resting_move(move)) {
      return false;
    }
    sliced_for_timing_.push_back(move);
    sliced_for_kept_.push_back(std::move(move));
  }
  move = std::move(own.front());
  own.pop_front();
  return true;
}

bool Verifier::take_output_move(OutputMove& move) {
  planner::PlannedMove played;
  if (!output_.next(played)) {
    return false;
  }
  move = output_filament_.laid(std::move(played));
  return true;
}

bool Verifier::next_output_move(OutputMove& move) {
  if (output_ahead_.empty()) {
    return take_output_move(move);
  }
  move = std::move(output_ahead_.front());
  output_ahead_.pop_front();
  return true;
}

// For progress_timing_, before the move is played.
bool Verifier::next_output_move_ahead(planner::PlannedMove& laid) {
  OutputMove move;
  if (!take_output_move(move)) {
    return false;
  }
  laid = move.laid;
  output_ahead_.push_back(std::move(move));
  return true;
}

// Whether the verification ends here because the move is endless.
bool Verifier::ends_here(const planner::PlannedMove& move, const Replay& file) {
  if (is_endless(move)) {
    failure_ = endless_move(move, file.reader().name());
  }
  return failure_.has_value();
}

void Verifier::begin_section(bool compensated) {
  max_lines_per_s_ = std::max(max_lines_per_s_, rate_.max_per_s());
  rate_.forget();
  base_.begin_run();
  run_steps_.clear();
  rules_of_run_.begin(rate_, since_kept_motion_s_ < kRingsFor_s,
                      compensated && output_.section().has_free_timing);
  path_.begin_section();
  follow_pressure(compensated);
  shape_sliced();
  for_sliced([&](Nozzles& nozzles) { nozzles.begin_section(path_); });
  if (compensated) {
    // A run begins at rest, and it has a clock of its own.
    emitted_.finish();
    violations_.begin_run();
    // A long rest, so that the path of the previous run does not count as near.
    run_path_.rest(kApart_s);
    has_free_timing_ = output_.section().has_free_timing;
    const bool is_played_as_planned = rules_.fixed.firmware != Firmware::marlin;
    kept_path_ = has_free_timing_ || !is_played_as_planned ? &resting_path_ : &run_path_;
    run_lead_in_s_ = 0.0;
    if (has_own_clock()) {
      sliced_for_timing_.clear();
      sliced_for_kept_.clear();
      resting_path_.rest(kApart_s);
    }
    if (has_free_timing()) {
      progress_timing_.begin(owed_filament_mm());
      output_ahead_.clear();
    } else {
      run_lead_in_s_ = output_.section().lead_in_s + planner::wait_s(output_.front(), rules_.fixed);
      flow_difference_.begin_run(run_lead_in_s_);
    }
    run_path_.begin_section(run_lead_in_s_);
    run_first_ = run_next_ = run_path_.end();
  }
  emitted_path_ = compensated ? &run_path_ : &path_;
  shape_emitted();
  emitted_.begin_section(*emitted_path_);
  if (compensated) {
    const Meter& emitted = emitted_.main();
    if (has_own_clock()) {
      resting_path_.begin_section();
    }
    kept_.begin_section(*kept_path_);
    kept_.set_state(emitted.nozzle(), emitted.base_x_mm(), emitted.base_y_mm());
    // The kept moves would begin at once, without a lead-in.
    kept_.skip(has_own_clock() ? 0.0 : run_lead_in_s_);
    kept_next_ = kept_first_ = kept_path_->end();
  }
  if (observer_ != nullptr) {
    observer_->section(path_, *emitted_path_);
  }
  filament_.begin_run(*emitted_path_);
  run_pushed_mm_ = 0.0;
  laying_checked_ = false;
  input_flow_.begin_section();
  output_flow_.begin_section();
  section_first_ = path_.end();
  original_next_ = path_.end();
  input_excursion_.clear();
  output_excursion_.clear();
  too_much_in_input_ = false;
  too_much_line_ = 0;
  if (compensated) {
    // Both nozzles begin with the same swing. If it were sampled only later, it might seem smaller.
    kept_.look();
  }
}

// By how much the filament of a run of free timing may be off in the end: a firmware that lays it
// in steps may owe some.
double Verifier::owed_filament_mm() const {
  constexpr double kOwedSteps = 1.5;
  return rules_.fixed.firmware == Firmware::klipper
             ? filament_tolerance_mm()
             : kOwedSteps / rules_.fixed.steps_per_mm[gcode::E];
}

void Verifier::play_run() {
  skip_added_barriers();
  const bool compensated = output_.has_move() && output_.section().compensated;
  begin_section(compensated);
  if (!compensated && input_.has_move() && output_.has_move()) {
    check_regime(input_.section(), output_.section());
  }
  if (compensated) {
    const gcode::ModalState& modal = output_.section().regime->modal;
    // A macro may have switched on what nobody has told of.
    const gcode::InterpreterOptions& told = rules_.interpreter;
    const bool is_touched = (modal.shaper_touched_x && told.shaper_unknown_x) ||
                            (modal.shaper_touched_y && told.shaper_unknown_y);
    if (modal.input_shaper().is_on() || modal.input_shaper().is_unknown() || is_touched) {
      violations_.in_output(output_.section().line.number,
                            "the printer's input shaper is on in a compensated run");
    }
  }
  emitted_.follow_lag(compensated);
  emitted_.follow_feed(compensated && output_.section().has_free_timing);
  totals_.runs += compensated ? 1 : 0;
  play_run_moves(compensated);
  emitted_.follow_lag(false);
  if (failure_ || progress_->cancelled()) {
    return;
  }
  end_section();
  filament_.end_run();
  compare_lines(true);
  check_run(compensated);
}

// unflex stops the machine before a run to set it up; the sliced file has no such stop.
void Verifier::skip_added_barriers() {
  while (!output_.has_move() && output_.following().may_be_added &&
         (input_.has_move() || !same_line(input_.following().line, output_.following().line))) {
    join_over_barrier();
  }
}

// The machine stands still where unflex switches its shaper.
void Verifier::join_over_barrier() {
  const double switching_s = output_switching_.stop(output_.following().switching_s);
  emitted_.hold(switching_s);
  output_flow_.rest(switching_s);
  totals_.emitted_time_s += switching_s;
  since_kept_motion_s_ += switching_s;
  output_.join_over_barrier();
}

void Verifier::shape_sliced() {
  static_cast<void>(input_.has_move());  // so that the regime of a run is known
  if (!takes_shaper(input_.section(), original_shaper_)) {
    return;
  }
  const planner::Shaping shaping = planner::shaping(rules_.fixed, original_shaper_);
  if (shaping.acts() && !unshaped_) {
    unshaped_ = original_;
    unshaped_->main().drop_line();  // nothing is told of it
    unshaped_->watch_as(NozzleBase::unshaped);
    if (observer_ == nullptr || !observer_->asks_for_unshaped()) {
      unshaped_->drop_detuned();
    }
    original_.watch_as(NozzleBase::shaped);
  }
  original_.shape(shaping);
}

// Where nothing else is known, the hotend is taken to be what the sliced file advances for.
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

// What the section of either file makes of the filament in the hotend.
void Verifier::follow_pressure(bool compensated) {
  static_cast<void>(input_.has_move());  // so that the regime of a run is known
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
  if (takes_shaper(output_.section(), emitted_shaper_)) {
    emitted_.shape(planner::shaping(rules_.fixed, emitted_shaper_));
  }
}

void Verifier::play_run_moves(bool compensated) {
  OutputMove move;
  for (;;) {
    if (next_output_move(move)) {
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
      if (++moves_ % kMovesPerUpdate == 0) {
        compare_lines(false);
        report_progress();
        if (progress_->cancelled()) {
          return;
        }
      }
      continue;
    }
    if (!output_.following().may_be_added) {
      return;
    }
    // After a run unflex stops the machine once more.
    finish_reference();
    if (same_line(input_.following().line, output_.following().line)) {
      return;
    }
    join_over_barrier();
    // So that what the next part is printed with is known.
    static_cast<void>(output_.has_move());
    set_pressure(emitted_, output_.section());
  }
}

void Verifier::play(const OutputMove& output) {
  const planner::PlannedMove& move = output.pushed;
  rate_.add(move);
  output_switching_.move();
  const double start_s = emitted_.plan_time_s();
  const bool compensated = emitted_path_ == &run_path_;
  const bool late = emitted_path_->section_complete() &&
                    start_s >= emitted_path_->end_s() + kLate_s + emitted_.main().lag_s();
  since_kept_motion_s_ += move.duration_s();
  if (!compensated && move.segment.extruding() && !laying_checked_) {
    check_advance(false, move.segment.line);
    laying_checked_ = true;
  }
  if (!compensated && move.segment.length_xy_mm() > 0.0) {
    since_kept_motion_s_ = 0.0;
  }
  output_notes_.play(move.segment.line, totals_.emitted_time_s);
  emitted_.play(output.laid, move);
  filament_.play(output.laid, start_s);
  run_pushed_mm_ += move.segment.delta(gcode::E);
  if (compensated) {
    rules_of_run_.add(output.laid, emitted_.main(), late,
                      has_free_timing() ? owed_filament_mm() : filament_tolerance_mm());
  }
  totals_.emitted_time_s += move.duration_s();
  totals_.output_extrusion_mm += move.segment.delta(gcode::E);
  output_flow_.play(output.laid);
  if (compensated && !has_free_timing()) {
    flow_difference_.play_output(output.laid);
  }
  output_steps_.play(move);
  output_excursion_.add(move.segment);
  if (too_much_line_ == 0 && move.segment.too_much_filament) {
    too_much_line_ = move.segment.line;
  }
  // The original advances in its section as far as the emitted nozzle has in its own.
  if (compensated && has_own_clock()) {
    let_original_follow_moves();
  } else {
    const double elapsed_s = emitted_.plan_time_s() - emitted_path_->section_start_s();
    path_.extend_to(path_.section_start_s() + elapsed_s);
    let_original_follow(path_.section_start_s() + elapsed_s);
  }
}

// Where the two are not on one clock, the original advances up to the move that the emitted nozzle
// has passed.
void Verifier::let_original_follow_moves() {
  while (run_next_ < run_path_.end() && run_path_[run_next_].end_s <= emitted_.plan_time_s()) {
    ++run_next_;
  }
  let_original_follow(end_of_passed_s(path_, section_first_));
}

// When the last move ends that the emitted nozzle has passed, on another path of the section, whose
// first piece is given.
double Verifier::end_of_passed_s(ReferencePath& path, std::size_t first) const {
  const std::size_t passed = run_next_ - run_first_;
  while (path.end() - first < passed && !path.section_complete()) {
    path.extend_to(path.end_s());
  }
  const std::size_t known = std::min(path.end() - first, passed);
  return known > 0 ? path[first + known - 1].end_s : path.section_start_s();
}

void Verifier::let_original_follow(double until_s) {
  while (original_next_ < path_.end() && path_[original_next_].end_s <= until_s) {
    // A copy, because playing makes the path grow, which moves its pieces.
    const planner::PlannedMove move = path_[original_next_++].move;
    for_sliced([&](Nozzles& nozzles) { nozzles.play(move); });
  }
  double needed_s = original_.main().time_s();
  if (observer_ != nullptr) {
    observer_->advanced(path_, needed_s);
    needed_s -= observer_->memory_s();
  }
  if (emitted_path_ == &path_) {
    path_.discard_before(std::min(needed_s, emitted_.main().time_s()) - original_.main().reach_s());
    input_.skip_resting();
  } else {
    path_.discard_before(needed_s - original_.main().reach_s());
    let_kept_follow(has_own_clock() ? end_of_passed_s(resting_path_, kept_first_)
                                    : emitted_.plan_time_s());
    if (has_own_clock()) {
      run_path_.discard_before(emitted_.main().time_s() - emitted_.main().reach_s());
      resting_path_.discard_before(kept_.time_s() - kept_.reach_s());
    } else {
      run_path_.discard_before(std::min(kept_.time_s(), emitted_.main().time_s()) -
                               emitted_.main().reach_s());
    }
  }
}

void Verifier::let_kept_follow(double until_s) {
  while (kept_next_ < kept_path_->end() && (*kept_path_)[kept_next_].end_s <= until_s) {
    const planner::PlannedMove move = (*kept_path_)[kept_next_++].move;
    kept_.play(move);
  }
}

void Verifier::end_section() {
  if (emitted_path_ == &run_path_) {
    emitted_.finish();
  }
  emitted_.wait_for_reference();
  if (emitted_path_ == &run_path_) {
    while (!kept_path_->section_complete()) {
      kept_path_->extend_to(kept_path_->end_s());
    }
    let_kept_follow(std::numeric_limits<double>::infinity());
    if (!has_free_timing()) {
      flow_difference_.end_run();
    }
  }
  finish_reference();
  check_flow();
}

void Verifier::finish_reference() {
  while (!path_.section_complete()) {
    path_.extend_to(path_.end_s());
    let_original_follow(path_.end_s());
  }
  let_original_follow(std::numeric_limits<double>::infinity());
}

void Verifier::play_kept_line() {
  begin_section(false);
  OutputMove move;
  while (take_output_move(move) && !ends_here(move.pushed, output_)) {
    play(move);
  }
  end_section();
  const double input_s =
      input_.section().dwell_s + input_switching_.stop(input_.section().switching_s);
  const double output_s =
      output_.section().dwell_s + output_switching_.stop(output_.section().switching_s);
  if (input_s > 0.0) {
    path_.rest(input_s);
    input_flow_.rest(input_s);
    for_sliced([&](Nozzles& nozzles) { nozzles.hold(input_s); });
    if (observer_ != nullptr) {
      observer_->hold(input_s);
    }
  }
  if (output_s > 0.0) {
    emitted_.hold(output_s);
    output_flow_.rest(output_s);
    since_kept_motion_s_ += output_s;
  }
  // The sliced file has no pause before it draws.
  totals_.reference_time_s += input_.section().is_approach ? 0.0 : input_s;
  totals_.emitted_time_s += output_s;
}

// After the end of the file the base is held: what the nozzle still does then counts as well.
void Verifier::hold() {
  begin_section(false);
  const double hold_s = rules_.nozzle.hold_s;
  path_.hold(original_.plan_x_mm(), original_.plan_y_mm(), hold_s);
  const auto rest = [&](Nozzles& nozzles) {
    nozzles.play(resting(nozzles.plan_x_mm(), nozzles.plan_y_mm(), hold_s));
    nozzles.finish();
  };
  for_sliced(rest);
  rest(emitted_);
  // The last flow ends, whatever hold_s is.
  input_flow_.rest(2.0 * FlowGauge::kMean_s);
  output_flow_.rest(2.0 * FlowGauge::kMean_s);
}

void Verifier::compare_lines(bool complete) {
  lines_.compare(complete, place_tolerance_mm(rules_, base_.accel_limit_mm_s2()));
}

void Verifier::report_progress() {
  const auto read = static_cast<double>(output_.reader().bytes_read());
  progress_->update("verifying", output_bytes_ > 0.0 ? std::min(1.0, read / output_bytes_) : -1.0);
}

VerifyReport Verifier::report() {
  VerifyReport report = totals_;
  report.reference_time_s -= input_switching_.since_motion_s();
  report.emitted_time_s -= output_switching_.since_motion_s();
  report.uncompensated = deviation(original_.main());
  if (unshaped_) {
    report.unshaped = deviation(unshaped_->main());
  }
  report.compensated = deviation(emitted_.main());
  for (std::size_t i = 0; i < original_.detuned(); ++i) {
    report.detuned.push_back(
        {original_.deviation_of_detuned(i), std::nullopt, emitted_.deviation_of_detuned(i)});
    if (unshaped_ && i < unshaped_->detuned()) {
      report.detuned.back().unshaped = unshaped_->deviation_of_detuned(i);
    }
  }
  report.uncompensated_lag = original_.main().filament_lag();
  report.compensated_lag = emitted_.main().filament_lag();
  report.compensated_feed = emitted_.main().feed();
  report.uncompensated_corners = original_.main().corners();
  report.compensated_corners = emitted_.main().corners();
  for (Nozzles* const nozzles : {&original_, &emitted_}) {
    nozzles->main().line()->finish();
  }
  report.uncompensated_line = original_.main().line()->stats();
  report.compensated_line = emitted_.main().line()->stats();
  report.uncompensated_flow = input_flow_.stats();
  report.compensated_flow = output_flow_.stats();
  report.flow_difference = flow_difference_.stats();
  report.sliced_steps = input_steps_.largest();
  report.emitted_steps = output_steps_.largest();
  report.sliced_step_breaches = input_steps_.breaches();
  report.base_max_velocity_mm_s = base_.max_velocity_mm_s();
  report.base_max_accel_mm_s2 = base_.max_accel_mm_s2();
  report.base_max_step_mm_s = base_.max_step_mm_s();
  report.base_accel_limit_mm_s2 = base_.largest_accel_limit_mm_s2();
  report.worst_run_drift_s = emitted_.main().worst_lag_s();
  report.max_lines_per_s = std::max(max_lines_per_s_, rate_.max_per_s());
  report.segment_ms_median = 1e3 * base_.median_duration_s();
  report.output_lines = output_.lines_read();
  report.output_bytes = output_.reader().bytes_read();
  report.violation_count = violations_.count();
  report.violations = violations_.take();
  report.blamed_runs = violations_.take_blamed();
  report.time_notes = time_notes(input_notes_, output_notes_);
  return report;
}

Result<VerifyReport> verify(std::istream& input, const std::string& input_name,
                            std::istream& output, const std::string& output_name,
                            const Rules& rules, Progress& progress,
                            const Observation& observation) {
  return Verifier(input, input_name, output, output_name, rules, progress, observation).verify();
}

}  // namespace unflex::verify
