// Notation:
//   r, p, b   reference, nozzle and base      h   step of the integration
#include "meter.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "unflex/core/math.hpp"

namespace unflex::verify {
namespace {

// Times closer together than this are the same; the time axis of a print of days resolves 1e-11 s.
constexpr double kSameTime_s = 1e-10;

// The interval of looks in a long cruise whether the nozzle has come to rest on the base.
constexpr double kLook_s = 1.0;
// The factor by which steps may be longer at rest, since only the place still changes.
constexpr double kSparser = 6.0;

bool is_cruise(const BasePhase& phase) {
  return all_axes([](const dynamics::BaseSegment& base) { return base.acceleration == 0.0; },
                  phase.xy);
}

// The state of the base h seconds later.
void advance(dynamics::BaseSegment& base, double h) {
  base.position += h * (base.velocity + 0.5 * base.acceleration * h);
  base.velocity += base.acceleration * h;
}

void advance(dynamics::BaseXY& base, double h) {
  for_each_axis([h](dynamics::BaseSegment& of_axis) { advance(of_axis, h); }, base);
}

std::vector<NozzleModel> with(const NozzleModel& model, const std::vector<NozzleModel>& others) {
  std::vector<NozzleModel> all = {model};
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

}  // namespace

Meter::Meter(const NozzleModel& model, const std::vector<NozzleModel>& others, double least_reach_s)
    : bundle_(with(model, others)), near_(std::max(verify::reach_s(model), least_reach_s)) {}

void Meter::watch(Observer* observer, NozzleBase base) {
  observer_ = observer;
  base_ = base;
  if (line_) {
    line_->watch(observer_, {base_, 0});
  }
}

void Meter::drop_others() { bundle_.keep_first(); }

void Meter::set_models(const std::vector<NozzleModel>& models) {
  bundle_.set_models(models, base_mm_);
  last_look_.reset();
}

void Meter::set_machine(const MachineChange& change, const gcode::Position& at) {
  over_bed_ = change.acts_over_bed() ? &change : nullptr;
  if (!places_) {
    places_.emplace();
  }
  machine_at_mm_ = at;
  bundle_.set_frequencies(change.frequency_shares(at));
}

void Meter::follow_line(const LineModel& model) {
  line_.emplace(model);
  line_->watch(observer_, {base_, 0});
}

void Meter::set_state(const NozzleXY& nozzle, const XY& base_mm) {
  bundle_.set_nozzle(0, nozzle, base_mm);
  last_look_.reset();
  base_mm_ = base_mm;
}

void Meter::begin_section(ReferencePath& path, double unplayed_s, double unplayed_mm) {
  if (path_ != &path) {
    path_ = &path;
    near_.begin(path);
    current_ = path.first();
    if (corners_) {
      corners_->begin(path);
    }
  }
  if (line_) {
    line_->begin_section(path);
  }
  const double begin_s = path.section_start_s() - unplayed_s;
  if (corners_) {
    corners_->begin_section(path, time_s_ - begin_s);
  }
  time_s_ = begin_s;
  laid_mm_ = path.filament_mm() - unplayed_mm;
  section_error_ = {};
  last_look_.reset();
}

double Meter::base_offset_mm() {
  static_cast<void>(next_reference_change());
  if (path_->first() == path_->end()) {
    return 0.0;
  }
  // Before the reference starts, the path near its start counts. After it has ended, the path near
  // its end counts.
  near_.slide(*path_, std::clamp(time_s_, (*path_)[path_->first()].start_s, path_->end_s()));
  std::size_t nearest = 0;
  return std::sqrt(near_.squared_contour_error(*path_, base_mm_, nearest));
}

double Meter::to_path_end_mm(const gcode::Position& from) const {
  if (path_->first() == path_->end()) {
    return 0.0;
  }
  const gcode::Position& end = (*path_)[path_->end() - 1].move.segment.end_mm;
  return distance(xy_of(end), xy_of(from));
}

double Meter::swing_mm() const {
  if (path_->first() == path_->end()) {
    return 0.0;
  }
  return verify::swing_mm(nozzle(), (*path_)[path_->end() - 1].move.segment.end_mm,
                          bundle_.model());
}

void Meter::follow_lag(bool on) {
  lag_.restart();
  follow_lag_ = on;
}

void Meter::shift_to(const XY& place_mm) {
  if (place_mm == base_mm_) {
    return;
  }
  if (corners_) {
    corners_->lift();
  }
  bundle_.shift(place_mm - base_mm_);
  last_look_.reset();
  base_mm_ = place_mm;
}

void Meter::play(const planner::PlannedMove& move, const planner::PlannedMove& pushed) {
  shift_to(xy_of(move.segment.start_mm));
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
  base_mm_ = xy_of(move.segment.end_mm);
}

void Meter::settle(const BasePhase& phase) {
  bundle_.settle(phase.xy, phase.duration_s);
  last_look_.reset();
  if (corners_) {
    corners_->lift();
  }
  if (line_) {
    line_->rest(phase.duration_s);
  }
  dynamics::BaseXY end = phase.xy;
  advance(end, phase.duration_s);
  base_mm_ = dynamics::place_mm(end);
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
  base_mm_ = dynamics::place_mm(phase.xy);
}

// The first time after now at which the reference begins another phase or move; infinity once its
// section has ended.
double Meter::next_reference_change() {
  path_->extend_to(time_s_ + reach_s());
  if (corners_) {
    corners_->follow(*path_);
  }
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

// Moves base and nozzles by h seconds. rides: the nozzles rest on the base and stay at rest on it.
void Meter::step(BasePhase& phase, double h, bool rides) {
  if (over_bed_ != nullptr && !rides) {
    set_xy(machine_at_mm_, dynamics::place_mm(phase.xy));
    bundle_.set_frequencies(over_bed_->frequency_shares(machine_at_mm_));
  }
  bundle_.step(phase.xy, phase.z);
  advance(phase.xy, h);
  advance(phase.z, h);
  advance(phase.e, h);
  advance(phase.pushed, h);
  if (rides) {
    bundle_.ride_on(phase.xy);
  }
}

void Meter::integrate(BasePhase& phase, double duration_s, bool measured) {
  const bool rides = is_cruise(phase) && bundle_.rest_on(phase.xy);
  const double longest_s = (rides ? kSparser : 1.0) * bundle_.step_s();
  const double steps = std::max(1.0, std::ceil(duration_s / longest_s - 1e-9));
  const double h = duration_s / steps;
  const double start_s = time_s_;
  bundle_.begin_steps(steps, h);
  ReferencePhase reference;
  if (measured) {
    path_->extend_to(start_s + duration_s + reach_s());
    if (corners_) {
      corners_->follow(*path_);
    }
    reference = reference_phase((*path_)[current_], time_s_, duration_s);
  }
  const bool looks = measured || phase.extruding;
  if (!looks || (last_look_ && last_measured_ != measured)) {
    last_look_.reset();
  }
  dynamics::NozzleMotionXY nozzle = bundle_.motion(0);
  const auto look_after = [&](double since_s) {
    return measured ? look(reference, nozzle, since_s) : look_at_rest(nozzle, since_s);
  };
  if (looks && !last_look_) {
    last_look_ = look_after(0.0);
  }
  last_measured_ = measured;
  for (double number = 1.0; number <= steps; number += 1.0) {
    const dynamics::NozzleMotionXY from = nozzle;
    const dynamics::BaseSegment pushed_from = phase.pushed;
    step(phase, h, rides);
    nozzle = bundle_.motion(0);
    time_s_ = start_s + number * h;
    if (corners_) {
      corners_->pass(time_s_, from, nozzle, h);
    }
    Sample sample;
    if (looks) {
      advance(reference.xy, h);
      sample = look_after(h);
      bundle_.count(measured, phase.extruding);
      count(*last_look_, sample, reference, nozzle, measured, phase.extruding, h);
      last_look_ = sample;
    }
    if (measured && phase.extruding && bundle_.moves_in_z()) {
      const PathPiece& piece = (*path_)[current_];
      height_.add(phase.z.position + bundle_.above_mm() -
                      piece.move.position_mm(time_s_ - piece.start_s)[gcode::Z],
                  h);
    }
    if (!waiting_) {
      count_filament(phase, pushed_from, reference, nozzle, measured, h);
    }
    if (observer_ != nullptr) {
      tell(phase, h, measured, reference, sample);
    }
  }
  time_s_ = start_s;
}

// Measures the filament's lag and the line of plastic in the h seconds that end now. pushed_from:
// the filament's motion when they began.
void Meter::count_filament(const BasePhase& phase, const dynamics::BaseSegment& pushed_from,
                           const ReferencePhase& reference, const dynamics::NozzleMotionXY& nozzle,
                           bool measured, double h) {
  const bool follows_line = line_ && line_->is_measuring();
  const bool has_lag = measured && follows_filament_ && (reference.extruding || phase.extruding);
  if (!follows_line && !has_lag) {
    return;
  }
  const std::optional<PathPlace> at = place(measured, reference, nozzle);
  if (has_lag && at) {
    filament_lag_.add(*path_, *at, laid_mm_ + phase.e.position, phase.extruding, h);
  }
  if (follows_line) {
    const double mean_mm2 = measured || phase.extruding ? bundle_.mean_mm2() : 0.0;
    line_->add(*path_, {h, phase.pushed.position - pushed_from.position, pushed_from.velocity,
                        phase.pushed.velocity, phase.extruding, mean_mm2, at});
  }
}

Meter::Sample Meter::look(const ReferencePhase& reference, const dynamics::NozzleMotionXY& nozzle,
                          double since_s) {
  near_.slide(*path_, time_s_);
  bundle_.look(*path_, near_, since_s);
  const XY error_mm = dynamics::place_mm(reference.xy) - dynamics::place_mm(nozzle);
  return {squared(error_mm), (*path_)[bundle_.nearest()].move.segment.line};
}

// Looks while filament is laid before the reference moves, or after it has ended.
Meter::Sample Meter::look_at_rest(const dynamics::NozzleMotionXY& nozzle, double since_s) {
  if (path_->first() == path_->end()) {
    return {};
  }
  const bool before = current_ < path_->end();
  const std::size_t piece = before ? current_ : path_->end() - 1;
  near_.slide(*path_, std::clamp(time_s_, (*path_)[piece].start_s, (*path_)[piece].end_s));
  bundle_.look(*path_, near_, since_s);
  const gcode::Segment& segment = (*path_)[piece].move.segment;
  const gcode::Position& at = before ? segment.start_mm : segment.end_mm;
  return {squared(xy_of(at) - dynamics::place_mm(nozzle)),
          (*path_)[bundle_.nearest()].move.segment.line};
}

// Adds the time between two looks to the figures. laying: the phase being played lays filament.
void Meter::count(const Sample& from, const Sample& to, const ReferencePhase& reference,
                  const dynamics::NozzleMotionXY& nozzle, bool measured, bool laying, double h) {
  const double tracking2 = 0.5 * (from.tracking2_mm2 + to.tracking2_mm2);
  const double tracking2_max = std::max(from.tracking2_mm2, to.tracking2_mm2);
  const auto add = [&](DeviationAccumulator& figures) {
    figures.add(bundle_.mean_mm2(), bundle_.largest_mm2(), tracking2, tracking2_max, h, to.line);
  };
  if (measured) {
    add(all_);
  }
  if (laying) {
    add(extruding_);
    section_error_.add(bundle_.mean_mm2(), bundle_.largest_mm2(), h, to.line);
    if (places_) {
      places_->add(dynamics::place_mm(nozzle), machine_at_mm_[gcode::Z], bundle_.mean_mm2(), h);
    }
  }
  if (!measured) {
    return;
  }
  if (laying && follow_feed_ && (*path_)[bundle_.nearest()].extruding) {
    feed_.add(squared(dynamics::velocity_mm_s(nozzle)),
              (*path_)[bundle_.nearest()].move.segment.feed_mm_s, h, to.line);
  }
  if (follow_lag_) {
    const XY v_mm_s = dynamics::velocity_mm_s(reference.xy);
    lag_.add(dot(dynamics::place_mm(reference.xy) - dynamics::place_mm(nozzle), v_mm_s),
             squared(v_mm_s), h);
  }
}

// Where the nozzle is on the path. While the reference does not move, it is where the reference
// will begin, or has ended.
std::optional<PathPlace> Meter::place(bool measured, const ReferencePhase& reference,
                                      const dynamics::NozzleMotionXY& nozzle) const {
  if (measured) {
    return nearest_place(*path_, current_, dynamics::place_mm(reference.xy),
                         dynamics::place_mm(nozzle));
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
  step.base = phase.xy;
  step.extruding = phase.extruding;
  step.line = sample.line;
  step.measured = measured;
  step.waiting = waiting_;
  if (measured) {
    step.reference_mm = dynamics::place_mm(reference.xy);
    step.piece = current_;
  }
  for (std::size_t number = 0; number < bundle_.count(); ++number) {
    step.nozzle = bundle_.motion(number);
    if (measured || phase.extruding) {
      step.contour2_mm2 = bundle_.now_mm2(number);
      step.mean_contour2_mm2 = bundle_.mean_mm2(number);
      step.largest_contour2_mm2 = bundle_.largest_mm2(number);
    }
    observer_->step({base_, number}, step);
  }
}

void Meter::look() {
  static_cast<void>(next_reference_change());
  if (current_ < path_->end() && (*path_)[current_].measured &&
      (*path_)[current_].start_s <= time_s_ + kSameTime_s) {
    const Sample sample =
        look(reference_phase((*path_)[current_], time_s_, 0.0), bundle_.motion(0), 0.0);
    const bool laying = (*path_)[current_].extruding;
    bundle_.count_moment(laying);
    all_.add(bundle_.now_mm2(), sample.tracking2_mm2, 0.0, sample.line);
    if (laying) {
      extruding_.add(bundle_.now_mm2(), sample.tracking2_mm2, 0.0, sample.line);
      section_error_.add(0.0, bundle_.now_mm2(), 0.0, sample.line);
    }
  }
}

void Meter::wait_for_reference() {
  const std::vector<double> states = bundle_.states();
  const double time_s = time_s_;
  // Waits in bounded stretches, so that a reference far ahead need not be known to its end at once.
  waiting_ = true;
  path_->extend_to(time_s_ + kSameTime_s);
  while (path_->end_s() - time_s_ > kSameTime_s) {
    play(BasePhase{.xy = resting_at(base_mm_), .duration_s = path_->end_s() - time_s_});
    path_->extend_to(time_s_ + kSameTime_s);
  }
  waiting_ = false;
  bundle_.set_states(states);
  last_look_.reset();
  if (corners_) {
    corners_->set_clock_back(time_s_ - time_s);
    corners_->lift();
  }
  time_s_ = time_s;
}

void Meter::hold(double duration_s) {
  bundle_.settle(resting_at(base_mm_), duration_s);
  last_look_.reset();
  if (line_) {
    line_->rest(duration_s);
  }
  if (corners_) {
    corners_->lift();
  }
}

}  // namespace unflex::verify
