// UTF-8. The names of files and the texts in prints need not be valid UTF-8.
#pragma once

#include <cstddef>
#include <string_view>

namespace unflex {

struct Utf8Character {
  std::size_t length = 0;  // in bytes; 0 if there is no character
  char32_t value = 0;
};

// The first character of a text, which must not be empty. Overlong sequences, surrogates and values
// above U+10FFFF are no characters.
[[nodiscard]] Utf8Character first_utf8(std::string_view text);

}  // namespace unflex
