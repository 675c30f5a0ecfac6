// Checks of texts that users see. The program itself removes control characters.
#pragma once

#include <string>
#include <string_view>

#include "targets.hpp"
#include "unflex/core/error.hpp"

namespace unflex::fuzz {

inline void require_one_line(std::string_view text) {
  require(!text.empty(), "a message is empty");
  require(text.find('\n') == std::string_view::npos,
          "a message of several lines: " + std::string(text));
}

// Requires that the error blames the input.
inline void require_fault_of_input(const Error& error) {
  require(error.kind != ErrorKind::internal, "internal error: " + to_string(error));
  require_one_line(to_string(error));
}

}  // namespace unflex::fuzz
