// The beginning and end of a print, where slicers write what they know of the printer.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/text_store.hpp"

namespace unflex::machine {

// Settings as slicers hand them to their scripts: ("SLIC3R_NOZZLE_DIAMETER", "0.4").
using SlicerVariables = std::vector<std::pair<std::string, std::string>>;

struct PrintText {
  std::string name;           // for messages
  std::string head;           // whole lines from the first to the first move
  std::string tail;           // whole lines up to the last; empty if it cannot be had
  std::size_t tail_line = 0;  // number of the tail's first line
  bool is_stream = false;     // a pipe, whose tail comes too late
  // Settings that the slicer gives outside the text. If the text gives one too, the text counts.
  SlicerVariables variables = {};
};

// The head and the tail of a file. Errors are of kind input.
[[nodiscard]] Result<PrintText> read_print_text(const TextStore& text, const std::string& name);

// The most bytes that a head may have.
inline constexpr std::size_t kMaxHeadBytes = std::size_t{1} << 20U;
// The place where the head ends, of a print that begins like `text`: behind the line of the first
// move (G0 to G3). If no move comes within kMaxHeadBytes, the head ends behind the last whole line
// in these bytes. npos if more text is needed to tell. The result does not depend on the pieces in
// which the text comes.
[[nodiscard]] std::size_t head_end(std::string_view text);

}  // namespace unflex::machine
