// Lines that a finished file has earlier than where they were written.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"

namespace unflex::pipeline {

struct LineAhead {
  std::size_t before_line = 0;  // it comes to stand before this line
  std::size_t from_line = 0;    // where it stood; 0: it is new
  std::string text;             // with its line ending
};

// Puts the lines where they shall stand. They are numbered as before, and rise in both numbers that
// are not 0. Every other byte stays. Fails like rewrite_lines().
[[nodiscard]] Status put_ahead(const std::string& path, const std::string& name,
                               const std::vector<LineAhead>& lines);

// The number that a line has behind put_ahead(). It is none of those that were put ahead.
[[nodiscard]] std::size_t number_behind(const std::vector<LineAhead>& lines, std::size_t number);

}  // namespace unflex::pipeline
