// Prusa's binary G-code, version 1, as its specification has it (doc/specifications.md of
// libbgcode): a header and blocks of five kinds of metadata and of G-code; all numbers
// little-endian.
//
//   file:  "GCDE", version (4 bytes), type of checksums (2)
//   block: type (2), compression (2), size (4), packed size (4, if compressed), parameters (2, of
//          thumbnails 6), data, CRC-32 of all that (4, if the file has checksums)
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "unflex/container/container.hpp"

namespace unflex::container {

inline constexpr std::string_view kBgcodeMagic = "GCDE";
inline constexpr std::size_t kFileHeaderBytes = 10;
inline constexpr std::uint32_t kVersion = 1;

// The types in the order of their numbers. In a file they stand in another order.
enum class BlockType : std::uint16_t { file, gcode, slicer, printer, print, thumbnail };
inline constexpr std::size_t kBlockTypes = 6;
inline constexpr std::size_t kCompressions = 4;
inline constexpr std::size_t kEncodings = 3;
inline constexpr std::size_t kThumbnailFormats = 3;

// How comments name thumbnails, by format.
inline constexpr std::array<std::string_view, kThumbnailFormats> kThumbnailNames = {
    "thumbnail", "thumbnail_JPG", "thumbnail_QOI"};

// Encodings of metadata.
inline constexpr std::uint16_t kIni = 0;
inline constexpr std::uint16_t kJson = 1;

// The lines between which the settings stand in a text.
inline constexpr std::string_view kConfigKey = "prusaslicer_config";
inline constexpr std::string_view kJsonConfigKey = "prusaslicer_json_config";

// Prusa's G-code blocks are made of at most this much text, so that a printer can hold one.
inline constexpr std::size_t kGcodeBlockBytes = 65536;

// The data of a block before they were packed. nullopt if they are damaged.
[[nodiscard]] std::optional<std::string> decompress(std::string_view packed,
                                                    Compression compression, std::size_t size);
[[nodiscard]] std::string compress(std::string_view bytes, Compression compression);

[[nodiscard]] std::uint32_t crc32_of(std::string_view bytes);

}  // namespace unflex::container
