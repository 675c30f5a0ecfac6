// Puts lines of a finished file ahead of their places.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/text_store.hpp"

namespace unflex::temperature {

struct LineAhead {
  std::size_t before_line = 0;  // it comes to stand before this line
  std::size_t from_line = 0;    // where it stood; 0: it is new
  std::string text;             // with its line ending
};

// Puts the lines where they shall stand. Every other byte stays. Numbers are those before this
// change. From one LineAhead to the next before_line rises, and so does from_line where it is not
// 0. Fails like rewrite_lines().
[[nodiscard]] Status put_ahead(TextStore& text, const std::string& name,
                               const std::vector<LineAhead>& lines);

// The number that a line has after put_ahead(). The line must be none of those that were put ahead.
[[nodiscard]] std::size_t number_behind(const std::vector<LineAhead>& lines, std::size_t number);

}  // namespace unflex::temperature
