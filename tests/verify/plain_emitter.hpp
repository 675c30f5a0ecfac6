// A minimal emitter to test the judge with: it draws every run exactly as planned from rest to
// rest, in short lines.
#pragma once

#include <fmt/core.h>

#include <cmath>
#include <deque>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "unflex/gcode/compensable.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/planner/klipper_planner.hpp"

namespace unflex::verify::testing {

inline std::string set_limits(const planner::Limits& limits) {
  return fmt::format(
      "SET_VELOCITY_LIMIT VELOCITY={} ACCEL={} SQUARE_CORNER_VELOCITY={} MINIMUM_CRUISE_RATIO={}\n",
      limits.max_velocity_mm_s, limits.max_accel_mm_s2, limits.square_corner_velocity_mm_s,
      limits.minimum_cruise_ratio);
}

// For programs in G90, M83 and mm, with known positions. period_s: duration of the short lines.
class PlainEmitter {
 public:
  explicit PlainEmitter(double period_s = 2e-3) : period_s_(period_s) {}

  std::string emit(const std::string& input) {
    read(input);
    for (const gcode::Event& event : events_) {
      if (gcode::compensable(event, Firmware::klipper)) {
        begin_run();
        for (std::size_t i = 0; i < event.segments.size(); ++i) {
          emit_move(planned_.front());
          planned_.pop_front();
        }
      } else if (event.kind == gcode::EventKind::passive) {
        text_ += event.line.text;
      } else if (event.kind == gcode::EventKind::limits) {
        text_ += event.line.text;
        limits_.apply(*event.limits);
        text_ += in_run_ ? set_limits(kRaised) : "";
      } else {
        end_run();
        text_ += event.line.text;
        planned_.erase(planned_.begin(),
                       planned_.begin() + static_cast<std::ptrdiff_t>(event.segments.size()));
      }
      track_feed(event);
    }
    end_run();
    return text_;
  }

 private:
  static constexpr planner::Limits kRaised{300.0, 1e6, 1000.0, 0.0};

  void read(const std::string& input) {
    std::istringstream stream(input);
    gcode::LineReader reader(stream, "input");
    gcode::Interpreter interpreter;
    planner::KlipperPlanner planner({}, {});
    gcode::Line line;
    bool in_run = false;
    while (reader.next(line).value()) {
      gcode::Event event = interpreter.interpret(line);
      if (event.kind == gcode::EventKind::barrier || !event.segments.empty()) {
        if (gcode::compensable(event, Firmware::klipper) != in_run) {
          planner.stop();
        }
        in_run = gcode::compensable(event, Firmware::klipper);
      }
      for (const gcode::Segment& segment : event.segments) {
        planner.add(segment);
      }
      planner.apply(event);
      if (event.kind == gcode::EventKind::barrier) {
        planner.stop();
      }
      feeds_.push_back(interpreter.state().feed_mm_s);
      events_.push_back(std::move(event));
    }
    planner.stop();
    std::vector<planner::PlannedMove> moves;
    planner.take(moves);
    planned_.assign(moves.begin(), moves.end());
  }

  void track_feed(const gcode::Event& event) { feed_mm_s_ = feeds_[event.line.number - 1]; }

  void begin_run() {
    if (!in_run_) {
      text_ += ";unflex run\n" + set_limits(kRaised);
    }
    in_run_ = true;
  }

  void end_run() {
    if (in_run_) {
      text_ += ";unflex end\n" + set_limits(limits_.limits()) +
               fmt::format("G1 F{}\n", 60.0 * feed_mm_s_);
    }
    in_run_ = false;
  }

  void emit_move(const planner::PlannedMove& move) {
    const double duration = move.duration_s();
    const int lines = std::max(1, static_cast<int>(std::ceil(duration / period_s_)));
    gcode::Position last = move.segment.start_mm;
    double filament = 0.0;
    for (int i = 1; i <= lines; ++i) {
      const gcode::Position next = move.position_mm(duration * i / lines);
      const double length =
          std::hypot(next[gcode::X] - last[gcode::X], next[gcode::Y] - last[gcode::Y]);
      const double laid =
          std::round((next[gcode::E] - move.segment.start_mm[gcode::E]) * 1e5) / 1e5;
      text_ += fmt::format("G1 X{:.4f} Y{:.4f} Z{:.4f} E{:.5f} F{:.3f}\n", next[gcode::X],
                           next[gcode::Y], next[gcode::Z], laid - filament,
                           60.0 * length / (duration / lines));
      filament = laid;
      last = next;
    }
  }

  double period_s_;
  std::vector<gcode::Event> events_;
  std::vector<double> feeds_;
  std::deque<planner::PlannedMove> planned_;
  planner::KlipperPlanner limits_{{}, {}};
  double feed_mm_s_ = 25.0;
  bool in_run_ = false;
  std::string text_;
};

}  // namespace unflex::verify::testing
