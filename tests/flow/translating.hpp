// Programs that are translated line by line in memory, and read back.
#pragma once

#include <cmath>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tool_path.hpp"
#include "translator.hpp"
#include "unflex/core/firmware.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/gcode/line.hpp"

namespace unflex::flow {

inline kinematics::Machine machine_of(const Motors& motors,
                                      const kinematics::Joints& offset_mm = {}) {
  return {.mechanism = kinematics::Linear{.motors = motors, .offset_mm = offset_mm},
          .ranges_mm = {}};
}

// The default tripteron, c = 0.
inline kinematics::Machine tripteron() {
  return machine_of(Motors(Kinematics::tripteron, Firmware::klipper));
}

inline TranslatorOptions translating(const kinematics::Machine& machine,
                                     Firmware firmware = Firmware::klipper) {
  return {.interpreter = gcode::default_options(firmware),
          .machine = machine,
          .home_mm = kinematics::Point{0.0, 0.0, 0.0},
          .tolerance_mm = 0.005};
}

// The text, or "in.gcode:3: what is wrong".
inline std::string translated(const std::string& program, const TranslatorOptions& options) {
  std::istringstream stream(program);
  gcode::LineReader reader(stream, "in.gcode");
  Translator translator(options, "in.gcode");
  std::string text;
  for (gcode::Line line; reader.next(line).value();) {
    if (const Status done = translator.translate(line, text); !done) {
      return to_string(done.error());
    }
  }
  return text;
}

// What a printer does with a line that moves.
struct Played {
  std::vector<gcode::Segment> segments;
  std::size_t line = 0;
  double e_mm = 0.0;        // where E is afterwards, from the file's beginning
  double duration_s = 0.0;  // at constant speed
};

// Reads a text as the firmware does. home_mm: where its axes are after G28.
inline std::vector<Played> play(const std::string& text, const gcode::InterpreterOptions& options,
                                const kinematics::Point& home_mm) {
  std::istringstream stream(text);
  gcode::LineReader reader(stream, "played");
  gcode::Interpreter interpreter(options);
  std::vector<Played> moves;
  for (gcode::Line line; reader.next(line).value();) {
    const bool is_home = line.text.starts_with("G28");
    gcode::Event event = interpreter.interpret(line);
    if (is_home) {
      gcode::Line place;
      place.text = "G1 X" + std::to_string(home_mm[0]) + " Y" + std::to_string(home_mm[1]) + " Z" +
                   std::to_string(home_mm[2]);
      static_cast<void>(interpreter.interpret(place));
    }
    Played played{.segments = event.segments, .line = line.number};
    for (const gcode::Segment& segment : played.segments) {
      played.duration_s += segment.length_mm() / segment.feed_mm_s;
      played.e_mm = segment.end_mm[gcode::E];
    }
    if (!played.segments.empty()) {
      moves.push_back(std::move(played));
    }
  }
  return moves;
}

inline double distance_mm(const kinematics::Point& a, const kinematics::Point& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

inline std::size_t lines_of(const std::string& text) {
  std::size_t count = 0;
  for (const char c : text) {
    count += c == '\n' ? 1 : 0;
  }
  return count;
}

}  // namespace unflex::flow
