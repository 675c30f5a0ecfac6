// One of the two files as it is printed: its sections and moves, and the figures of each file by
// itself.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <istream>
#include <string>

#include "flow_gauge.hpp"
#include "replay.hpp"
#include "run_check.hpp"
#include "time_notes.hpp"
#include "unflex/verify/step_rates.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::verify {

// How long a machine has stood still for lines that switch its filters.
class Switching {
 public:
  // The stop that one more such line adds. Lines in a row are one stop.
  [[nodiscard]] double stop(double switching_s) {
    const double added_s = std::max(switching_s - since_motion_s_, 0.0);
    since_motion_s_ += added_s;
    return added_s;
  }
  void move() { since_motion_s_ = 0.0; }
  // The stops since the last motion. At the end of a file nothing waits for them.
  [[nodiscard]] double since_motion_s() const { return since_motion_s_; }

 private:
  double since_motion_s_ = 0.0;
};

class Track {
 public:
  using Listener = std::function<void(const gcode::Line&)>;

  // The stream and the rules must outlive the Track. `listener` is told each line before it is
  // interpreted.
  Track(std::istream& stream, const std::string& name, const Rules& rules, ReplayedFile file,
        Listener listener);

  Track(const Track&) = delete;
  Track& operator=(const Track&) = delete;

  [[nodiscard]] Replay& replay() { return replay_; }
  [[nodiscard]] const Replay& replay() const { return replay_; }
  [[nodiscard]] const Section& section() const { return replay_.section(); }

  void begin_section();
  // Plays a move. The filament that comes out may differ from the filament that the file pushes.
  void play(const planner::PlannedMove& pushed, const planner::PlannedMove& laid);
  // Counts the stop for the section's line, a dwell or a switch of filters, and returns how long
  // the machine stands still for it.
  [[nodiscard]] double rest_of_section_s();
  // Counts the stop for the added barrier that follows the section, in the same way.
  [[nodiscard]] double rest_of_following_s() {
    return switching_.stop(replay_.following().switching_s);
  }
  // The machine stands still. An approach is no part of the print, so its time does not count.
  void rest(double duration_s);
  // The file has ended. The last flow ends, too.
  void finish() { flow_.rest(2.0 * FlowGauge::kMean_s); }
  // Makes the shaper of the section the present one. Returns whether it was another one.
  bool takes_shaper();
  // The shaper that acts on this file's motion.
  [[nodiscard]] const gcode::Shaper& shaper() const { return shaper_; }

  // When the next move begins.
  [[nodiscard]] double time_s() const { return time_s_; }
  // How long the file prints.
  [[nodiscard]] double printing_s() const { return time_s_ - switching_.since_motion_s(); }
  // Filament pushed, in all and in the section.
  [[nodiscard]] double pushed_mm() const { return pushed_mm_; }
  [[nodiscard]] double pushed_in_section_mm() const { return pushed_in_section_mm_; }
  // The first line of the section that has too much filament for its way; 0: none.
  [[nodiscard]] std::size_t too_much_line() const { return too_much_line_; }
  [[nodiscard]] const TimeNotes& notes() const { return notes_; }
  [[nodiscard]] const FlowGauge& flow() const { return flow_; }
  [[nodiscard]] const StepGauge& steps() const { return steps_; }
  [[nodiscard]] const Excursion& excursion() const { return excursion_; }

 private:
  Replay replay_;
  TimeNotes notes_;
  FlowGauge flow_;
  StepGauge steps_;
  Excursion excursion_;  // of the section
  Switching switching_;
  gcode::Shaper shaper_;
  double time_s_ = 0.0;
  double pushed_mm_ = 0.0;
  double pushed_in_section_mm_ = 0.0;
  std::size_t too_much_line_ = 0;
};

}  // namespace unflex::verify
