// Packs and unpacks whole texts, and makes texts for that.
#pragma once

#include <cstddef>
#include <random>
#include <string>
#include <string_view>

#include "unflex/container/container.hpp"

namespace unflex::container {

struct Unpacked {
  std::string text;
  Metadata metadata;
  std::size_t longest_piece = 0;
};

// piece_bytes: how much is pushed at a time.
[[nodiscard]] Result<Unpacked> unpack(std::string_view bytes, std::size_t piece_bytes = 4096);
[[nodiscard]] Result<std::string> pack(Packer& packer, std::string_view text,
                                       std::size_t piece_bytes = 4096);
[[nodiscard]] Result<std::string> to_bgcode(std::string_view text, const Metadata* origin = nullptr,
                                            BgcodeOptions options = {});
[[nodiscard]] std::string to_gzip(std::string_view text);

// A file of tests/data.
[[nodiscard]] std::string test_data(std::string_view name);

// The first ten layers of a real print: bracket, cube, star, textplate or wallring.
[[nodiscard]] std::string ten_layers(std::string_view print);

// Commands and comments of all sorts, with nothing that MeatPack would change; every command in a
// line of its own and no comments but in lines of their own where `comments` is not set.
[[nodiscard]] std::string random_gcode(std::mt19937& random, std::size_t lines, bool comments);

// The lines that are neither blank nor a bare semicolon.
[[nodiscard]] std::string essential(std::string_view text);

}  // namespace unflex::container
