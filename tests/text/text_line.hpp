// A line of G-code, parsed as a firmware does.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "unflex/core/firmware.hpp"

namespace unflex::testing {

// Thrown if the firmware answers with an error.
struct Refused {};

// Klipper computes in double precision, Marlin and RepRapFirmware in single.
double kept(Firmware firmware, double value);
std::string capitals(std::string text);

// Cuts the first line off, without its end.
std::string_view take_line(std::string_view& text);

class TextLine {
 public:
  TextLine(Firmware firmware, std::string_view text);

  // The command, such as "G1", "M201.1" or "SET_VELOCITY_LIMIT"; empty for an empty line.
  [[nodiscard]] const std::string& command() const { return command_; }
  // Whether the line has a second command, which RepRapFirmware would carry out too.
  [[nodiscard]] bool has_second_command() const { return has_second_command_; }

  [[nodiscard]] bool has(std::string_view word) const { return words_.contains(word); }
  [[nodiscard]] bool has_any_of(std::string_view letters) const;
  // The text of a word, without quotes.
  [[nodiscard]] std::string text(std::string_view word) const;
  [[nodiscard]] std::optional<double> number(std::string_view word) const;

 private:
  void parse_klipper(const std::string& line);
  void parse_others(std::string line);

  Firmware firmware_;
  std::string command_;
  std::map<std::string, std::string, std::less<>> words_;
  bool has_second_command_ = false;
};

}  // namespace unflex::testing
