#include "track.hpp"

#include <utility>

namespace unflex::verify {

Track::Track(std::istream& stream, const std::string& name, const Rules& rules, ReplayedFile file,
             Listener listener)
    : replay_(stream, name, rules.interpreter, rules.limits, rules.fixed, file),
      flow_(rules.filament_area_mm2),
      steps_(rules.fixed, rules.steps),
      excursion_(rules.travel) {
  replay_.on_line([this, listener = std::move(listener)](const gcode::Line& line) {
    notes_.read(line);
    if (listener) {
      listener(line);
    }
  });
}

void Track::begin_section() {
  flow_.begin_section();
  excursion_.clear();
  pushed_in_section_mm_ = 0.0;
  too_much_line_ = 0;
}

void Track::play(const planner::PlannedMove& pushed, const planner::PlannedMove& laid) {
  const gcode::Segment& segment = pushed.segment;
  switching_.move();
  notes_.play(segment.line, time_s_);
  time_s_ += pushed.duration_s();
  pushed_mm_ += segment.delta(gcode::E);
  pushed_in_section_mm_ += segment.delta(gcode::E);
  flow_.play(laid);
  steps_.play(pushed);
  excursion_.add(segment);
  if (too_much_line_ == 0 && segment.too_much_filament) {
    too_much_line_ = segment.line;
  }
}

double Track::rest_of_section_s() {
  return section().dwell_s + switching_.stop(section().switching_s);
}

void Track::rest(double duration_s) {
  flow_.rest(duration_s);
  time_s_ += section().is_approach ? 0.0 : duration_s;
}

bool Track::takes_shaper() {
  if (!section().regime) {
    return false;
  }
  const gcode::Shaper shaper = section().regime->modal.shaper;
  const bool differs = shaper.freq_hz != shaper_.freq_hz || shaper.settings != shaper_.settings;
  shaper_ = shaper;
  return differs;
}

}  // namespace unflex::verify
