// Turns any bytes into prints as slicers write them.
#pragma once

#include <string>
#include <string_view>

#include "bytes.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::fuzz {

// Writes lines that the firmware accepts: moves, arcs, retractions, wipes, hops, modes, limits,
// pauses, macros and comments, in whatever mode is in force, between 20 and 80 mm. The first byte
// for each line selects its kind.
class ProgramWriter {
 public:
  ProgramWriter(const gcode::InterpreterOptions& options, double duration_s);

  [[nodiscard]] std::string program(Bytes source);

 private:
  void add(const std::string& text);
  [[nodiscard]] std::string next(Bytes& source);
  [[nodiscard]] std::string draw(Bytes& source, double least_mm, double most_mm);
  [[nodiscard]] std::string arc(Bytes& source);
  [[nodiscard]] std::string mode(Bytes& source);
  [[nodiscard]] std::string limits(Bytes& source) const;
  [[nodiscard]] std::string stop(Bytes& source);
  [[nodiscard]] std::string word(gcode::Axis axis, double to_mm) const;
  [[nodiscard]] std::string filament(Bytes& source, double length_mm) const;
  [[nodiscard]] std::string speed(Bytes& source) const;

  Firmware firmware_;
  gcode::Interpreter interpreter_;
  std::string text_;
  double heading_ = 0.0;
  double left_s_;
};

}  // namespace unflex::fuzz
