#include "nozzles.hpp"

#include <algorithm>

namespace unflex::verify {
namespace {

constexpr double kSameTime_s = 1e-10;

}  // namespace

Nozzles::Nozzles(const NozzleModel& model, const Observation& observation, NozzleBase base,
                 double least_reach_s)
    : main_(model, observation.detuned, least_reach_s), observer_(observation.observer) {
  main_.follow_filament();
  main_.follow_corners();
  watch_as(base);
}

void Nozzles::watch_as(NozzleBase base) {
  if (observer_ != nullptr) {
    main_.watch(observer_, base);
  }
}

double Nozzles::plan_time_s() const {
  return main_.time_s() + (shaped_ ? shaped_->unplayed_s() : 0.0);
}

XY Nozzles::plan_mm() const { return shaped_ ? xy_of(to_mm_) : main_.base_mm(); }

void Nozzles::begin_section(ReferencePath& path) {
  const double unplayed_s = shaped_ ? shaped_->unplayed_s() : 0.0;
  const double unplayed_mm = shaped_ ? shaped_->filament_mm() : 0.0;
  main_.begin_section(path, unplayed_s, unplayed_mm);
}

void Nozzles::shape(const planner::Shaping& shaping) {
  finish();
  shaping_ = shaping;
}

void Nozzles::play(const planner::PlannedMove& move, const planner::PlannedMove& pushed) {
  if (!shaping_.acts()) {
    rested_s_ = 0.0;
    main_.play(move, pushed);
    return;
  }
  const gcode::Position& from = move.segment.start_mm;
  if (!shaped_ || xy_of(from) != xy_of(to_mm_)) {
    finish();
    begin_shaped(from);
  }
  to_mm_ = move.segment.end_mm;
  phases_.clear();
  shaped_->add(move, phases_);
  play_shaped(phases_);
}

// The base moves before the plan, while the machine still stands. So the nozzles' clock goes back
// by that much, but no further than the machine has stood.
void Nozzles::begin_shaped(const gcode::Position& from) {
  shaped_.emplace(shaping_, xy_of(from));
  before_plan_s_ = shaped_->lead_s();
  const double back_s = std::min(before_plan_s_, rested_s_);
  main_.hold(-back_s);
  main_.shift_to(xy_of(from));
  rested_s_ = 0.0;
}

void Nozzles::play_shaped(const std::vector<BasePhase>& phases) {
  for (const BasePhase& phase : phases) {
    if (before_plan_s_ > kSameTime_s) {
      before_plan_s_ -= phase.duration_s;
      main_.settle(phase);
    } else {
      main_.play(phase);
    }
  }
}

double Nozzles::finish() {
  if (!shaped_) {
    return 0.0;
  }
  phases_.clear();
  std::vector<BasePhase> behind;
  shaped_->finish(phases_, behind);
  play_shaped(phases_);
  double duration_s = 0.0;
  for (const BasePhase& phase : behind) {
    main_.settle(phase);
    duration_s += phase.duration_s;
  }
  main_.add_filament(shaped_->filament_mm());
  shaped_.reset();
  return duration_s;
}

void Nozzles::wait_for_reference() {
  if (!shaped_) {
    main_.wait_for_reference();
  }
}

void Nozzles::hold(double duration_s) {
  const double rest_s = std::max(0.0, duration_s - finish());
  main_.hold(rest_s);
  rested_s_ += rest_s;
}

}  // namespace unflex::verify
