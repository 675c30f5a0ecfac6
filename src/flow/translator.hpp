// Lines of a print, one by one, with the joints of a machine in the places of X, Y and Z.
//
// What the firmware understands is known for certain, or the line is refused: a tool that goes
// where nobody has reckoned with it may break the machine. So the output gives all three joints in
// each line, as readings and never as differences.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "joint_line.hpp"
#include "tool_path.hpp"
#include "unflex/core/error.hpp"
#include "unflex/gcode/command.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/gcode/line.hpp"
#include "unflex/kinematics/machine.hpp"

namespace unflex::flow {

struct TranslatorOptions {
  gcode::InterpreterOptions interpreter;
  kinematics::Machine machine;
  std::optional<kinematics::Point> home_mm;  // where the tool is after G28
  double tolerance_mm = 0.0;                 // of lines that are cut, where J changes
};

class Translator {
 public:
  Translator(TranslatorOptions options, std::string name);

  // Appends what takes the line's place. Lines come in the order of the file. Errors are of kind
  // input, with the line.
  [[nodiscard]] Status translate(const gcode::Line& line, std::string& text);
  // Appends a comment to all of the text, by which a translated file is known again.
  void finish(std::string& text) const;

  [[nodiscard]] const std::vector<Diagnostic>& warnings() const { return warnings_; }
  [[nodiscard]] std::size_t moves() const { return moves_; }
  [[nodiscard]] std::size_t lines() const { return lines_; }

 private:
  [[nodiscard]] Status carry_over(const gcode::ModalState& before, std::string& text);
  [[nodiscard]] Status home(std::string& text);
  [[nodiscard]] Status select_tool(std::string& text);
  [[nodiscard]] Status motion(const gcode::ModalState& before, std::string& text);
  [[nodiscard]] Status filament_alone(std::string& text);
  [[nodiscard]] Status check_motion() const;
  [[nodiscard]] Status move(const gcode::ModalState& before, bool knows_start, std::string& text);
  void append_lines(const gcode::ModalState& before, bool knows_start,
                    const std::vector<ToolLine>& pieces, std::string& text);
  [[nodiscard]] std::int64_t feed_of(const ToolLine& piece, const ScaledJoints& to,
                                     bool knows_start) const;
  // Reads the written text as the printer does.
  void read_back(std::string_view written);
  // Whether what the printer does is what was meant.
  [[nodiscard]] Status check() const;
  void keep_mode_of_e(std::string& text);
  void warn_of_limits();
  [[nodiscard]] bool is_place_known() const { return known_[0] && known_[1] && known_[2]; }
  [[nodiscard]] tl::unexpected<Error> wrong(std::string what) const;

  TranslatorOptions options_;
  std::string name_;
  gcode::Interpreter sliced_;
  gcode::Interpreter written_;
  gcode::Event event_;
  gcode::Command command_;
  std::array<bool, 3> known_{};        // whether the file tells where the tool is along X, Y, Z
  std::string lost_by_ = "the start";  // what the place has not been told since
  bool needs_home_ = false;            // the motors have been off
  ScaledJoints joints_{};              // where the joints are, if the place is known
  // The printer may have left out the lines before, and with them their F.
  bool tells_feed_ = false;
  std::vector<Diagnostic> warnings_;
  bool told_of_limits_ = false;
  bool ends_with_newline_ = true;
  std::size_t moves_ = 0;
  std::size_t lines_ = 0;
};

}  // namespace unflex::flow
