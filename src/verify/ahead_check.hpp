// Checks lines that ask for a temperature earlier than the sliced file does. This is the only thing
// that may leave its place or be added without a form of its own, and it must stay harmless: it
// does not wait, it passes no other command to the hotend, no change of the tool, no pause and
// nothing that may be any of these, and then the sliced file asks for that same temperature.
#pragma once

#include <optional>
#include <string>

#include "unflex/core/firmware.hpp"
#include "unflex/gcode/hotend_command.hpp"
#include "unflex/gcode/line.hpp"

namespace unflex::verify {

class AheadCheck {
 public:
  // allowed: whether such lines may be at all.
  AheadCheck(Firmware firmware, bool allowed) : firmware_(firmware), allowed_(allowed) {}

  // Whether a line of the output that the sliced file does not have here asks ahead. If so, it is
  // awaited.
  [[nodiscard]] bool takes(const gcode::Line& output);
  // Whether a line of the sliced file that the output does not have here is the one awaited.
  [[nodiscard]] bool is_awaited(const gcode::Line& input) const;
  // The line that is_awaited() has come.
  void arrive() { awaited_.reset(); }
  // A line that both files have here. loses_place: it may move the machine or do anything. Returns
  // what is wrong if the awaited line should have come before.
  [[nodiscard]] std::optional<std::string> pass(const gcode::Line& line, bool loses_place);
  // The file has ended.
  [[nodiscard]] std::optional<std::string> end();

 private:
  [[nodiscard]] std::optional<gcode::HotendCommand> command(const gcode::Line& line) const;
  [[nodiscard]] bool is_target(std::optional<double> asked_c) const;
  [[nodiscard]] std::optional<std::string> never_asked();

  Firmware firmware_;
  bool allowed_;
  int tool_ = 0;
  std::optional<gcode::Line> awaited_;
  double target_c_ = 0.0;
};

}  // namespace unflex::verify
