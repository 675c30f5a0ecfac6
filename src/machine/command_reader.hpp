// Settings written as the firmware's own commands. The readers of Marlin's M503 and of
// RepRapFirmware's config.g share this part. Each command means what it means in a print, so the
// interpreter reads it.
#pragma once

#include <array>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "assign.hpp"
#include "unflex/gcode/command.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/machine/limit_keys.hpp"

namespace unflex::machine {

// The axes as keys spell them.
inline constexpr std::array<std::string_view, 4> kAxes = {"x", "y", "z", "e"};
// The end of a message that refuses a machine.
inline constexpr std::string_view kNotSupported =
    "unflex does not support yet; print the sliced file as it is on it";

[[nodiscard]] bool is_one_of(int number, std::initializer_list<int> numbers);

// The letter of an axis as commands spell it.
[[nodiscard]] char letter_of(std::size_t axis);

class CommandReader {
 public:
  CommandReader(Firmware firmware, std::string file);

  // Has the interpreter read a line with its command. Takes what the line sets and returns true, or
  // notes that it is not taken and returns false.
  bool take(const std::string& text, const gcode::Command& command, const SourcePlace& place);

  // Derives the tool's limits from the limits of X and Y, and adds them. The motors' limits follow
  // from them: velocity enough for the faster axis, acceleration not too much for the weaker.
  void finish();

  // A shaper's frequency is the resonance as it was measured.
  void shaper(const std::string& axis, double freq_hz, std::optional<double> damping_ratio,
              const SourcePlace& place);

  [[nodiscard]] const gcode::ModalState& state() const { return interpreter_.state(); }
  [[nodiscard]] const std::string& file() const { return file_; }

  Reading reading;

 private:
  using Found = std::optional<std::pair<double, SourcePlace>>;

  void not_taken(const std::string& text, const gcode::Command& command, const SourcePlace& place);
  void remember(const LimitValue& limit, const SourcePlace& place);
  void retraction(const SourcePlace& place);

  std::string file_;
  gcode::Interpreter interpreter_;
  // The latest limits of X and of Y.
  std::array<Found, 2> velocity_;
  std::array<Found, 2> accel_;
};

}  // namespace unflex::machine
