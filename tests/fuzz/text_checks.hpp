// What must hold of texts that users are shown.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>

#include "targets.hpp"
#include "unflex/core/error.hpp"

namespace unflex::fuzz {

// A terminal takes no commands from a print.
inline void require_printable(std::string_view text) {
  require(!text.empty(), "a message is empty");
  require(std::ranges::none_of(text,
                               [](char c) {
                                 const auto code = static_cast<unsigned char>(c);
                                 return code < 0x20 || code == 0x7f;
                               }),
          "a message holds control characters: " + std::string(text));
}

// That the input is to blame, in one line.
inline void require_fault_of_input(const Error& error) {
  require(error.kind != ErrorKind::internal, "internal error: " + to_string(error));
  require_printable(to_string(error));
}

}  // namespace unflex::fuzz
