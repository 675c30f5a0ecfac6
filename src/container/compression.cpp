#include <zlib.h>

#include "bgcode_format.hpp"
#include "heatshrink.hpp"

namespace unflex::container {
namespace {

constexpr unsigned kSmallWindowBits = 11;
constexpr unsigned kLargeWindowBits = 12;

// zlib counts by other types than the C++ library, on Windows by smaller ones; blocks are below 64
// KiB.
uLong count(std::size_t bytes) { return static_cast<uLong>(bytes); }

std::optional<std::string> inflate_all(std::string_view packed, std::size_t size) {
  // One byte more than there should be, so that too much data is noticed.
  std::string bytes(size + 1, '\0');
  uLongf got = count(bytes.size());
  uLong taken = count(packed.size());
  const int outcome = uncompress2(reinterpret_cast<Bytef*>(bytes.data()), &got,
                                  reinterpret_cast<const Bytef*>(packed.data()), &taken);
  if (outcome != Z_OK || got != size || taken != packed.size()) {
    return std::nullopt;
  }
  bytes.resize(size);
  return bytes;
}

std::string deflate_all(std::string_view bytes) {
  std::string packed(compressBound(count(bytes.size())), '\0');
  uLongf size = count(packed.size());
  ::compress(reinterpret_cast<Bytef*>(packed.data()), &size,
             reinterpret_cast<const Bytef*>(bytes.data()), count(bytes.size()));
  packed.resize(size);
  return packed;
}

}  // namespace

std::optional<std::string> decompress(std::string_view packed, Compression compression,
                                      std::size_t size) {
  switch (compression) {
    case Compression::none:
      break;
    case Compression::deflate:
      return inflate_all(packed, size);
    case Compression::heatshrink_11_4:
      return unheatshrink(packed, kSmallWindowBits, size);
    case Compression::heatshrink_12_4:
      return unheatshrink(packed, kLargeWindowBits, size);
  }
  return std::string(packed);
}

std::string compress(std::string_view bytes, Compression compression) {
  switch (compression) {
    case Compression::none:
      break;
    case Compression::deflate:
      return deflate_all(bytes);
    case Compression::heatshrink_11_4:
      return heatshrink(bytes, kSmallWindowBits);
    case Compression::heatshrink_12_4:
      return heatshrink(bytes, kLargeWindowBits);
  }
  return std::string(bytes);
}

std::uint32_t crc32_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace unflex::container
