// Heatshrink (A. Vail, S. Vokes 2013): LZSS in a stream of bits, most significant first. Bit 1 and
// 8 bits are a byte; bit 0, W bits of distance − 1 and L bits of length − 1 repeat earlier bytes.
// Bytes before the beginning count as zeros, as in the original's decoder.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace unflex::container {

// bytes must not be longer than 2^31. window_bits: W, 4 to 15. L is 4.
[[nodiscard]] std::string heatshrink(std::string_view bytes, unsigned window_bits);

// nullopt if the packed bytes are too few or too many for that size.
[[nodiscard]] std::optional<std::string> unheatshrink(std::string_view packed, unsigned window_bits,
                                                      std::size_t size);

}  // namespace unflex::container
