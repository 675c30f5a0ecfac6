// Whether E means what the text says it means.
#pragma once

#include <cstddef>
#include <optional>

#include "unflex/core/error.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::pipeline {

// Finds a print whose E words are differences although nothing in it has said so: the printer's
// macro or its configuration has set M83. Read as absolute, half of the moves would draw filament
// back, and the rest would lay far too much.
class ExtrusionModeCheck {
 public:
  // Lines in the order of the file, each with the state after it. An error once the mode is surely
  // another.
  [[nodiscard]] Status add(const gcode::Event& event, const gcode::ModalState& after,
                           const std::string& file);

 private:
  std::optional<double> last_mm_;  // what E read after the move before
  std::size_t pairs_ = 0;          // of moves in X and Y that follow each other
  std::size_t falls_ = 0;          // pairs as only differences can be
};

}  // namespace unflex::pipeline
