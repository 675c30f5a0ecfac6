// MeatPack (S. Mudge 2021) as binary G-code uses it: two characters of the sixteen most frequent in
// one byte, and no spaces between the words of G commands.
#pragma once

#include <string>
#include <string_view>

namespace unflex::container {

// Lines, each with its end, of which none may be empty or contain a byte 0xFF. Spaces go only where
// unmeatpack() puts them back. comments: lines that are comments stay, as they are; otherwise all
// comments are dropped.
[[nodiscard]] std::string meatpack(std::string_view lines, bool comments);

// Any bytes give a text.
[[nodiscard]] std::string unmeatpack(std::string_view packed);

}  // namespace unflex::container
