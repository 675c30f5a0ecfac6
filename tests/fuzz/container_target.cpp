// Containers of G-code: gzip and binary G-code.
#include <algorithm>
#include <array>
#include <string>

#include "bytes.hpp"
#include "text_checks.hpp"
#include "unflex/container/container.hpp"

namespace unflex::fuzz {
namespace {

using container::Kind;

// A few packed bytes can stand for any amount of text; more than this finds nothing new.
constexpr std::size_t kMostText = 1U << 20U;

struct Unpacked {
  std::string text;
  bool whole = true;  // read to its end without an error
};

// Pulls all available text; false at an error or if there is enough.
bool pull_all(container::Unpacker& unpacker, Unpacked& unpacked) {
  for (;;) {
    const Result<std::string> piece = unpacker.pull();
    if (!piece) {
      require_fault_of_input(piece.error());
    }
    if (!piece || unpacked.text.size() > kMostText) {
      unpacked.whole = false;
      return false;
    }
    if (piece->empty()) {
      return true;
    }
    unpacked.text += *piece;
  }
}

Unpacked unpack(Kind kind, std::string_view packed, std::size_t piece_bytes) {
  const auto unpacker = container::make_unpacker(kind, "fuzz");
  Unpacked unpacked;
  while (!packed.empty()) {
    const std::string_view piece = packed.substr(0, piece_bytes);
    unpacker->push(piece);
    packed.remove_prefix(piece.size());
    if (!pull_all(*unpacker, unpacked)) {
      return unpacked;
    }
  }
  unpacker->finish();
  pull_all(*unpacker, unpacked);
  return unpacked;
}

Result<std::string> pack(container::Packer& packer, std::string_view text) {
  if (packer.wants_survey()) {
    if (Status surveyed = packer.survey(text); !surveyed) {
      return tl::unexpected(surveyed.error());
    }
  }
  Result<std::string> packed = packer.push(text);
  if (!packed) {
    return packed;
  }
  return packer.finish().map([&](const std::string& rest) { return *packed + rest; });
}

container::BgcodeOptions options(Bytes& source) {
  using container::Compression;
  constexpr std::array kCompressions = {Compression::none, Compression::deflate,
                                        Compression::heatshrink_11_4, Compression::heatshrink_12_4};
  constexpr std::array kEncodings = {container::Encoding::none, container::Encoding::meatpack,
                                     container::Encoding::meatpack_comments};
  return {.metadata = kCompressions[source.variant(2)],
          .gcode = kCompressions[source.variant(4)],
          .encoding = kEncodings[source.variant(3)],
          .checksum = source.variant(2) == 0};
}

void check_packed(Kind kind, Bytes source) {
  const auto packer = kind == Kind::gzip
                          ? container::make_gzip_packer()
                          : container::make_bgcode_packer("fuzz", nullptr, options(source));
  const Result<std::string> packed = pack(*packer, source.rest());
  if (!packed) {
    return require_fault_of_input(packed.error());
  }
  require(container::detect(*packed) == kind, "what was packed is told for something else");
  const Unpacked unpacked = unpack(kind, *packed, packed->size());
  require(unpacked.whole, "what was packed is refused");
  require(kind != Kind::gzip || unpacked.text == source.rest(), "packed text is another text");
}

}  // namespace

void container(std::string_view bytes) {
  Bytes source(bytes);
  const std::size_t variant = source.variant(4);
  const Kind kind = variant % 2 == 0 ? Kind::gzip : Kind::bgcode;
  if (variant >= 2) {
    return check_packed(kind, source);
  }
  const std::size_t piece_bytes = source.byte() + 1;
  const std::string_view packed = source.rest();
  static_cast<void>(container::detect(packed));
  const Unpacked at_once = unpack(kind, packed, std::max<std::size_t>(packed.size(), 1));
  const Unpacked in_pieces = unpack(kind, packed, piece_bytes);
  require(at_once.whole == in_pieces.whole && (!at_once.whole || at_once.text == in_pieces.text),
          "text depends on the pieces it was packed in");
}

}  // namespace unflex::fuzz
