// UTF-8, which the names of files and what prints say need not be.
#pragma once

#include <cstddef>
#include <string_view>

namespace unflex {

struct Utf8Character {
  std::size_t length = 0;  // in bytes; 0 if there is no character
  char32_t value = 0;
};

// The character that a text begins with, which is not empty. Sequences longer than need be,
// surrogates and what is above U+10FFFF are none.
[[nodiscard]] Utf8Character first_utf8(std::string_view text);

}  // namespace unflex
