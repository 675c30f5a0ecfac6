// Whether E means what the text says it means.
#pragma once

#include <cstddef>
#include <optional>

#include "unflex/core/error.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {

// Finds a print whose E words are differences although nothing in it has said so: the printer's
// macro or its configuration has set M83. Read as absolute, half of the moves would draw filament
// back, and the rest would lay far too much.
class ExtrusionModeCheck {
 public:
  // Takes the lines in the order of the file, each with the state after it. An error once E is
  // surely relative although the state says absolute.
  [[nodiscard]] Status add(const gcode::Event& event, const gcode::ModalState& after,
                           const std::string& file);

 private:
  std::optional<double> last_mm_;  // what E read after the previous move
  std::size_t pairs_ = 0;          // pairs of moves in X and Y that follow each other
  std::size_t falls_ = 0;          // pairs in which E falls to less than a move lays
};

}  // namespace unflex::gcode
