#include "playback.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "text_checks.hpp"
#include "unflex/gcode/line.hpp"

namespace unflex::fuzz {
namespace {

bool all_finite(const gcode::Position& position) {
  return std::ranges::all_of(position, [](double value) { return std::isfinite(value); });
}

void check_event(const gcode::Event& event, const gcode::ModalState& state) {
  const std::string place = fmt::format("line {}: ", event.line.number);
  for (const std::string& warning : event.warnings) {
    require_one_line(warning);
  }
  require(all_finite(state.position_mm) && all_finite(state.base_mm),
          place + "the position is no number");
  require(std::isfinite(event.dwell_s) && event.dwell_s >= 0.0, place + "a pause of no length");
  require((event.kind == gcode::EventKind::move) == !event.segments.empty(),
          place + "a move without motion, or motion without a move");
  for (const gcode::Segment& segment : event.segments) {
    require(all_finite(segment.start_mm) && all_finite(segment.end_mm),
            place + "motion to nowhere");
    require(std::isfinite(segment.feed_mm_s) && segment.feed_mm_s > 0.0,
            place + fmt::format("speed of {} mm/s", segment.feed_mm_s));
  }
}

}  // namespace

Playback play(const std::string& text, const PrinterSetup& setup, std::size_t most_segments) {
  Playback playback;
  std::istringstream stream(text);
  gcode::LineReader reader(stream, "fuzz.gcode");
  gcode::Interpreter interpreter(setup.interpreter);
  const auto planner = planner::make_planner(setup.limits, setup.fixed);
  for (;;) {
    gcode::Line line;
    const Result<bool> more = reader.next(line);
    if (!more) {
      require_fault_of_input(more.error());
      playback.whole = false;
    }
    if (!more || !*more) {
      break;
    }
    if (playback.given.size() >= most_segments) {
      playback.whole = false;
      break;
    }
    playback.text += line.text;
    gcode::Event event = interpreter.interpret(std::move(line));
    check_event(event, interpreter.state());
    planner->apply(event);
    for (const gcode::Segment& segment : event.segments) {
      playback.given.push_back({segment, planner->limits()});
      planner->add(segment);
    }
    if (event.kind == gcode::EventKind::barrier) {
      planner->stop();
    }
    playback.warnings += event.warnings.size();
    playback.events.push_back(std::move(event));
  }
  planner->stop();
  planner->take(playback.moves);
  require(planner->pending() == 0, "the planner keeps moves after a stop");
  playback.end = interpreter.state();
  playback.limits = planner->limits();
  return playback;
}

}  // namespace unflex::fuzz
