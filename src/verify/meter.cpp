// Notation:
//   r, p, b   reference, nozzle and base      h   step of the integration
#include "meter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace unflex::verify {
namespace {

// Times closer together than this are the same; the time axis of a print of days resolves 1e-11 s.
constexpr double kSameTime_s = 1e-10;
constexpr double kLagMemory_s = 0.1;
constexpr double kLagLeastMemory_s = 0.05;
constexpr double kLagLeastSpeed_mm_s = 5.0;

// In a long cruise we look so often whether the nozzle has come to rest on the base.
constexpr double kLook_s = 1.0;
// Below this it has. What is left, less than an atom, is dropped, and samples may be this many
// times further apart, since nothing but the place changes any more.
constexpr double kRests_mm = 1e-7;
constexpr double kSparser = 32.0;

bool is_cruise(const BasePhase& phase) {
  return phase.x.acceleration == 0.0 && phase.y.acceleration == 0.0;
}

bool rests_on(const dynamics::FlexibleAxis& axis, const dynamics::NozzleState& nozzle,
              const dynamics::BaseSegment& base) {
  const dynamics::FlexibleAxis::Gap gap =
      axis.gap(nozzle, axis.riding(base.position, base.velocity));
  return std::max(gap.place_mm, gap.speed_mm) < kRests_mm;
}

// The state of the base h seconds later.
void advance(dynamics::BaseSegment& base, double h) {
  base.position += h * (base.velocity + 0.5 * base.acceleration * h);
  base.velocity += base.acceleration * h;
}

}  // namespace

void LagEstimate::add(double error_dot_velocity, double velocity2, double h) {
  if (h != last_h_) {
    last_h_ = h;
    keep_ = std::exp(-h / kLagMemory_s);
  }
  error_dot_velocity_ = keep_ * error_dot_velocity_ + h * error_dot_velocity;
  velocity2_ = keep_ * velocity2_ + h * velocity2;
  weight_s_ = keep_ * weight_s_ + h;
  if (weight_s_ >= kLagLeastMemory_s &&
      velocity2_ >= kLagLeastSpeed_mm_s * kLagLeastSpeed_mm_s * weight_s_) {
    worst_s_ = std::max(worst_s_, std::abs(error_dot_velocity_) / velocity2_);
  }
}

void LagEstimate::restart() {
  error_dot_velocity_ = 0.0;
  velocity2_ = 0.0;
  weight_s_ = 0.0;
}

Meter::Meter(const NozzleModel& model, double near_s) : model_(model), near_(near_s) {}

void Meter::watch(Observer* observer, NozzleId id) {
  observer_ = observer;
  id_ = id;
  if (line_) {
    line_->watch(observer_, id_);
  }
}

void Meter::follow_line(const LineModel& model) {
  line_.emplace(model);
  line_->watch(observer_, id_);
}

void Meter::set_state(const NozzleXY& nozzle, double base_x_mm, double base_y_mm) {
  nozzle_ = nozzle;
  base_x_mm_ = base_x_mm;
  base_y_mm_ = base_y_mm;
}

void Meter::begin_section(ReferencePath& path, double unplayed_s, double unplayed_mm) {
  if (path_ != &path) {
    path_ = &path;
    near_.begin(path);
    current_ = path.first();
    corner_piece_ = path.end();
    while (corner_piece_ > path.first() && path[corner_piece_ - 1].section == path.section()) {
      --corner_piece_;
    }
  }
  corner_section_ = path.section();
  if (line_) {
    line_->begin_section(path);
  }
  const double begin_s = path.section_start_s() - unplayed_s;
  corner_shift_s_ += time_s_ - begin_s;
  time_s_ = begin_s;
  laid_mm_ = path.filament_mm() - unplayed_mm;
  section_error_ = {};
}

double Meter::base_offset_mm() {
  static_cast<void>(next_reference_change());
  if (path_->first() == path_->end()) {
    return 0.0;
  }
  // Before the reference starts, the path near its start counts; after it has ended, that near its
  // end.
  near_.slide(*path_, std::clamp(time_s_, (*path_)[path_->first()].start_s, path_->end_s()));
  std::size_t nearest = 0;
  return std::sqrt(near_.squared_contour_error(*path_, base_x_mm_, base_y_mm_, nearest));
}

double Meter::to_path_end_mm(const gcode::Position& from) const {
  if (path_->first() == path_->end()) {
    return 0.0;
  }
  const gcode::Position& end = (*path_)[path_->end() - 1].move.segment.end_mm;
  return std::hypot(from[gcode::X] - end[gcode::X], from[gcode::Y] - end[gcode::Y]);
}

double Meter::swing_mm() const {
  if (path_->first() == path_->end()) {
    return 0.0;
  }
  return verify::swing_mm(nozzle_, (*path_)[path_->end() - 1].move.segment.end_mm, model_);
}

void Meter::follow_lag(bool on) {
  lag_.restart();
  follow_lag_ = on;
}

void Meter::shift_to(double x_mm, double y_mm) {
  if (corners_ && (x_mm != base_x_mm_ || y_mm != base_y_mm_)) {
    corners_->lift();
  }
  nozzle_.x.add(model_.x.riding(x_mm - base_x_mm_));
  nozzle_.y.add(model_.y.riding(y_mm - base_y_mm_));
  base_x_mm_ = x_mm;
  base_y_mm_ = y_mm;
}

void Meter::play(const planner::PlannedMove& move, const planner::PlannedMove& pushed) {
  shift_to(move.segment.start_mm[gcode::X], move.segment.start_mm[gcode::Y]);
  phases_.clear();
  append_phases(move, pushed.segment.delta(gcode::E), phases_);
  const double start_s = time_s_;
  double elapsed_s = 0.0;
  for (const BasePhase& phase : phases_) {
    play(phase);
    elapsed_s += phase.duration_s;
    time_s_ = start_s + elapsed_s;
  }
  laid_mm_ += move.segment.extruding() ? move.segment.delta(gcode::E) : 0.0;
  base_x_mm_ = move.segment.end_mm[gcode::X];
  base_y_mm_ = move.segment.end_mm[gcode::Y];
}

void Meter::settle(const BasePhase& phase) {
  nozzle_.x = dynamics::exact_step(model_.x, nozzle_.x, phase.x, phase.duration_s);
  nozzle_.y = dynamics::exact_step(model_.y, nozzle_.y, phase.y, phase.duration_s);
  if (corners_) {
    corners_->lift();
  }
  if (line_) {
    line_->rest(phase.duration_s);
  }
  BasePhase end = phase;
  advance(end.x, phase.duration_s);
  advance(end.y, phase.duration_s);
  base_x_mm_ = end.x.position;
  base_y_mm_ = end.y.position;
}

// Splits a phase of the base where the reference changes its acceleration or its move.
void Meter::play(BasePhase phase) {
  const double end_s = time_s_ + phase.duration_s;
  while (end_s - time_s_ > kSameTime_s) {
    const double change_s = next_reference_change();
    const bool measured = current_ < path_->end() && (*path_)[current_].measured &&
                          (*path_)[current_].start_s <= time_s_ + kSameTime_s;
    double until_s = change_s < end_s - kSameTime_s ? change_s : end_s;
    if (is_cruise(phase) && until_s - time_s_ > 2.0 * kLook_s) {
      until_s = time_s_ + kLook_s;
    }
    integrate(phase, until_s - time_s_, measured);
    time_s_ = until_s;
  }
  base_x_mm_ = phase.x.position;
  base_y_mm_ = phase.y.position;
}

// The first time after now at which the reference begins another phase or move; infinity once its
// section has ended.
double Meter::next_reference_change() {
  path_->extend_to(time_s_ + reach_s());
  take_corners();
  current_ = std::max(current_, path_->first());
  while (current_ < path_->end() && (*path_)[current_].end_s <= time_s_ + kSameTime_s) {
    ++current_;
  }
  if (current_ == path_->end()) {
    return std::numeric_limits<double>::infinity();
  }
  const PathPiece& piece = (*path_)[current_];
  if (!piece.timing.empty()) {
    return piece.start_s + piece.timing[piece.passage_after(time_s_ + kSameTime_s)].time_s;
  }
  double change_s = piece.start_s;
  for (const planner::Phase& phase : piece.move.phases()) {
    if (change_s > time_s_ + kSameTime_s) {
      return change_s;
    }
    change_s += phase.duration_s;
  }
  return piece.end_s;
}

// Pieces of a later section are on a clock that begin_section() will tell.
void Meter::take_corners() {
  if (!corners_) {
    return;
  }
  corner_piece_ = std::max(corner_piece_, path_->first());
  while (corner_piece_ < path_->end() && (*path_)[corner_piece_].section <= corner_section_) {
    const PathPiece& piece = (*path_)[corner_piece_++];
    corners_->follow(piece.move, piece.start_s + corner_shift_s_, piece.end_s + corner_shift_s_);
  }
}

void Meter::integrate(BasePhase& phase, double duration_s, bool measured) {
  // For fewer steps it does not pay to set up maps.
  constexpr double kManySteps = 8.0;
  if (is_cruise(phase) && rests_on(model_.x, nozzle_.x, phase.x) &&
      rests_on(model_.y, nozzle_.y, phase.y)) {
    const double few = std::ceil(duration_s / (kSparser * model_.step_s) - 1e-9);
    const double h = duration_s / std::max(1.0, few);
    integrate(phase, std::max(1.0, few), h, measured, [&] {
      nozzle_.x = model_.x.riding(phase.x.position + h * phase.x.velocity, phase.x.velocity);
      nozzle_.y = model_.y.riding(phase.y.position + h * phase.y.velocity, phase.y.velocity);
    });
    return;
  }
  const double steps = std::max(1.0, std::ceil(duration_s / model_.step_s - 1e-9));
  const double h = duration_s / steps;
  if (steps < kManySteps) {
    integrate(phase, steps, h, measured, [&] {
      nozzle_.x = dynamics::rk4_step(model_.x, nozzle_.x, phase.x, h);
      nozzle_.y = dynamics::rk4_step(model_.y, nozzle_.y, phase.y, h);
    });
    return;
  }
  const dynamics::Rk4Map map_x(model_.x, h);
  const dynamics::Rk4Map map_y(model_.y, h);
  integrate(phase, steps, h, measured, [&] {
    map_x.advance(phase.x, nozzle_.x);
    map_y.advance(phase.y, nozzle_.y);
  });
}

template <typename OneStep>
void Meter::integrate(BasePhase& phase, double steps, double h, bool measured,
                      const OneStep& step) {
  const double start_s = time_s_;
  ReferencePhase reference;
  if (measured) {
    path_->extend_to(start_s + steps * h + reach_s());
    take_corners();
    reference = reference_phase(steps * h);
  }
  for (double number = 1.0; number <= steps; number += 1.0) {
    step();
    advance(phase.x, h);
    advance(phase.y, h);
    advance(phase.e, h);
    const dynamics::BaseSegment pushed_from = phase.pushed;
    advance(phase.pushed, h);
    if (corners_) {
      corners_->sample(start_s + number * h + corner_shift_s_, nozzle_.x.position(),
                       nozzle_.y.position());
    }
    Sample measurement;
    if (measured) {
      time_s_ = start_s + number * h;
      advance(reference.x, h);
      advance(reference.y, h);
      measurement = sample(reference, phase.extruding, h);
    } else if (phase.extruding) {
      time_s_ = start_s + number * h;
      measurement = sample_at_rest(h);
    }
    const bool follows_line = line_ && line_->is_measuring();
    const bool has_lag = measured && follows_filament_ && (reference.extruding || phase.extruding);
    if (!waiting_ && (follows_line || has_lag)) {
      const std::optional<PathPlace> at = place(measured, reference);
      if (has_lag && at) {
        filament_lag_.add(*path_, *at, laid_mm_ + phase.e.position, phase.extruding, h);
      }
      if (follows_line) {
        line_->add(*path_, {h, phase.pushed.position - pushed_from.position, pushed_from.velocity,
                            phase.pushed.velocity, phase.extruding, measurement.contour2_mm2, at});
      }
    }
    if (observer_ != nullptr) {
      time_s_ = start_s + number * h;
      tell(phase, h, measured, reference, measurement);
    }
  }
}

// The reference's motion for the next duration_s. In that time it must change neither its
// acceleration nor its move.
Meter::ReferencePhase Meter::reference_phase(double duration_s) const {
  const PathPiece& piece = (*path_)[current_];
  const planner::PlannedMove& move = piece.move;
  const double local_s = time_s_ - piece.start_s;
  const double middle_s = local_s + 0.5 * duration_s;
  const double share_xy = move.length_mm > 0.0 ? piece.length_xy_mm / move.length_mm : 0.0;
  double acceleration = 0.0;
  double covered = 0.0;
  double speed = 0.0;
  if (piece.timing.empty()) {
    double phase_end_s = 0.0;
    for (const planner::Phase& phase : move.phases()) {
      phase_end_s += phase.duration_s;
      acceleration = phase.accel_mm_s2;
      if (middle_s < phase_end_s) {
        break;
      }
    }
    covered = move.distance_mm(local_s) * share_xy;
    speed = move.velocity_mm_s(local_s) * share_xy;
  } else {
    const std::size_t after = piece.passage_after(piece.start_s + middle_s);
    const Passage& from = piece.timing[after - 1];
    const Passage& to = piece.timing[after];
    const double lasts_s = to.time_s - from.time_s;
    covered = piece.covered_xy_mm(time_s_);
    speed = lasts_s > 0.0 ? (to.covered_mm - from.covered_mm) / lasts_s * share_xy : 0.0;
  }
  const auto along = [&](double start_mm, double direction) {
    return dynamics::BaseSegment{start_mm + direction * covered, direction * speed,
                                 direction * acceleration * share_xy};
  };
  return {along(piece.x_mm, piece.direction_x), along(piece.y_mm, piece.direction_y),
          piece.extruding};
}

// laying: filament is laid by what is played now.
Meter::Sample Meter::sample(const ReferencePhase& reference, bool laying, double h) {
  const double nozzle_x_mm = nozzle_.x.position();
  const double nozzle_y_mm = nozzle_.y.position();
  const double error_x = reference.x.position - nozzle_x_mm;
  const double error_y = reference.y.position - nozzle_y_mm;

  near_.slide(*path_, time_s_);
  std::size_t nearest = current_;
  const double contour2 = near_.squared_contour_error(*path_, nozzle_x_mm, nozzle_y_mm, nearest);
  const double tracking2 = error_x * error_x + error_y * error_y;
  const std::size_t line = (*path_)[nearest].move.segment.line;
  all_.add(contour2, tracking2, h, line);
  if (laying) {
    extruding_.add(contour2, tracking2, h, line);
    section_error_.add(contour2, h, line);
    if (follow_feed_ && (*path_)[nearest].extruding) {
      const double v_x = nozzle_.x.velocity();
      const double v_y = nozzle_.y.velocity();
      feed_.add(v_x * v_x + v_y * v_y, (*path_)[nearest].move.segment.feed_mm_s, h, line);
    }
  }
  if (follow_lag_) {
    const double v_x = reference.x.velocity;
    const double v_y = reference.y.velocity;
    lag_.add(error_x * v_x + error_y * v_y, v_x * v_x + v_y * v_y, h);
  }
  return {contour2, line};
}

// Filament is laid before the reference moves or after it has ended.
Meter::Sample Meter::sample_at_rest(double h) {
  if (path_->first() == path_->end()) {
    return {};
  }
  const bool before = current_ < path_->end();
  const std::size_t piece = before ? current_ : path_->end() - 1;
  const double begin_s = (*path_)[piece].start_s;
  near_.slide(*path_, std::clamp(time_s_, begin_s, (*path_)[piece].end_s));
  std::size_t nearest = piece;
  const double contour2 =
      near_.squared_contour_error(*path_, nozzle_.x.position(), nozzle_.y.position(), nearest);
  const gcode::Segment& segment = (*path_)[piece].move.segment;
  const gcode::Position& at = before ? segment.start_mm : segment.end_mm;
  const double error_x = at[gcode::X] - nozzle_.x.position();
  const double error_y = at[gcode::Y] - nozzle_.y.position();
  const std::size_t line = (*path_)[nearest].move.segment.line;
  extruding_.add(contour2, error_x * error_x + error_y * error_y, h, line);
  section_error_.add(contour2, h, line);
  return {contour2, line};
}

// Where the nozzle is on the path. While the reference does not move, it is where the reference
// will begin, or has ended.
std::optional<PathPlace> Meter::place(bool measured, const ReferencePhase& reference) const {
  if (measured) {
    return nearest_place(*path_, current_, reference.x.position, reference.y.position,
                         nozzle_.x.position(), nozzle_.y.position());
  }
  if (path_->first() == path_->end()) {
    return std::nullopt;
  }
  const bool before = current_ < path_->end();
  const std::size_t piece = before ? current_ : path_->end() - 1;
  return PathPlace{piece, before ? 0.0 : (*path_)[piece].length_xy_mm};
}

void Meter::tell(const BasePhase& phase, double h, bool measured, const ReferencePhase& reference,
                 const Sample& sample) {
  NozzleStep step;
  step.time_s = time_s_;
  step.h_s = h;
  step.nozzle = nozzle_.motion();
  step.base_x = phase.x;
  step.base_y = phase.y;
  step.extruding = phase.extruding;
  step.contour2_mm2 = sample.contour2_mm2;
  step.line = sample.line;
  step.measured = measured;
  step.waiting = waiting_;
  if (measured) {
    step.reference_x_mm = reference.x.position;
    step.reference_y_mm = reference.y.position;
    step.piece = current_;
  }
  observer_->step(id_, step);
}

void Meter::look() {
  static_cast<void>(next_reference_change());
  if (current_ < path_->end() && (*path_)[current_].measured &&
      (*path_)[current_].start_s <= time_s_ + kSameTime_s) {
    static_cast<void>(sample(reference_phase(0.0), (*path_)[current_].extruding, 0.0));
  }
}

void Meter::wait_for_reference() {
  const NozzleXY nozzle = nozzle_;
  const double time_s = time_s_;
  // Waits in bounded stretches, so that a reference far ahead need not be known to its end at once.
  waiting_ = true;
  path_->extend_to(time_s_ + kSameTime_s);
  while (path_->end_s() - time_s_ > kSameTime_s) {
    play(BasePhase{.x = {base_x_mm_, 0.0, 0.0},
                   .y = {base_y_mm_, 0.0, 0.0},
                   .duration_s = path_->end_s() - time_s_});
    path_->extend_to(time_s_ + kSameTime_s);
  }
  waiting_ = false;
  nozzle_ = nozzle;
  corner_shift_s_ += time_s_ - time_s;
  time_s_ = time_s;
  if (corners_) {
    corners_->lift();
  }
}

void Meter::hold(double duration_s) {
  nozzle_.x = dynamics::exact_step(model_.x, nozzle_.x, {base_x_mm_, 0.0, 0.0}, duration_s);
  nozzle_.y = dynamics::exact_step(model_.y, nozzle_.y, {base_y_mm_, 0.0, 0.0}, duration_s);
  if (line_) {
    line_->rest(duration_s);
  }
  if (corners_) {
    corners_->lift();
  }
}

}  // namespace unflex::verify
