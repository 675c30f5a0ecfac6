// The travel of axes in RepRapFirmware's config.g: M208.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

#include "assign.hpp"

namespace unflex::machine {

// Each letter of a line, in upper case, with the text of its value, or of its values if colons part
// them. A value is a number, an expression in braces, or a text in quotes.
[[nodiscard]] std::map<char, std::vector<std::string_view>> values_of(std::string_view arguments);

class RrfTravel {
 public:
  // Reads what is behind M208: X0:220, or X0 with S1 for the minimum and X220 for the maximum.
  // Notes what is no number.
  void read(std::string_view arguments, const SourcePlace& place, Reading& reading);

  // Adds the travel of X and Y as far as it is known.
  void add_to(Reading& reading) const;

 private:
  struct End {
    std::optional<double> mm;
    SourcePlace place;
    bool is_outdated = false;  // a later line gave no number
  };
  struct Ends {
    End min;
    End max;
  };

  std::array<Ends, 2> axes_;
};

}  // namespace unflex::machine
