// MeatPack (S. Mudge 2021) as binary G-code uses it: two characters of the sixteen most frequent in
// one byte, and no spaces between the words of G commands.
#pragma once

#include <string>
#include <string_view>

namespace unflex::container {

// Packs lines, each with its end. No line may be empty or contain a byte 0xFF. Spaces are left out
// only where unmeatpack() puts them back. comments: whether comments are kept or dropped; lines
// that are comments are kept as they are.
[[nodiscard]] std::string meatpack(std::string_view lines, bool comments);

// Unpacks; any bytes give a text.
[[nodiscard]] std::string unmeatpack(std::string_view packed);

}  // namespace unflex::container
