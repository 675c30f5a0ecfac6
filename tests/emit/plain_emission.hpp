// Whole programs through the emitter, with a base that follows the plan.
#pragma once

#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include "plain_base.hpp"
#include "unflex/emit/emitter.hpp"
#include "unflex/run/piece_reader.hpp"

namespace unflex::emit::testing {

// Observes the printer's and the input's state before every line outside of runs.
struct Boundary {
  const Emitter* emitter = nullptr;
  const gcode::ModalState* input = nullptr;
  const planner::Limits* input_limits = nullptr;
  std::size_t line = 0;
};

struct Emission {
  std::string text;
  std::size_t runs = 0;
};

inline Emission emit(const std::string& input, const EmitOptions& options,
                     const std::function<void(const Boundary&)>& look = nullptr) {
  std::istringstream stream(input);
  run::PieceReader reader(stream, "input", options.interpreter, options.printer_limits,
                          options.fixed);
  Emitter emitter(options);
  gcode::Interpreter interpreter(options.interpreter);
  planner::Limits limits = options.printer_limits;
  Emission emission;
  run::Piece piece;
  while (reader.next(piece).value()) {
    if (look) {
      look({&emitter, &interpreter.state(), &limits, piece.events.front().line.number});
    }
    bool written = false;
    if (piece.is_run && !piece.moves.empty()) {
      const dynamics::BaseTrajectory base = plan_as_base(piece.moves);
      const Run run{&piece.events, &piece.move_counts, &piece.moves, &base, 0.0};
      const RunPlan plan = plan_run(run, emitter.run_start(), options);
      written = !plan.empty();
      if (written) {
        emitter.run(run, plan, emission.text);
      }
      emission.runs += written ? 1 : 0;
    }
    for (const gcode::Event& event : piece.events) {
      if (!written) {
        emitter.line(event, emission.text);
      }
      static_cast<void>(interpreter.interpret(event.line));
      planner::apply(*event.limits, limits);
    }
  }
  if (look) {
    look({&emitter, &interpreter.state(), &limits, 0});
  }
  emitter.finish(emission.text);
  return emission;
}

inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    lines.push_back(text.substr(begin, end - begin));
    begin = end;
  }
  return lines;
}

}  // namespace unflex::emit::testing
