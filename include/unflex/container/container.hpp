// Packings of G-code: gzip (RFC 1952) and Prusa's binary G-code. Bytes in, text out, and the
// reverse, in pieces and with bounded memory. Nothing here reads or writes a file.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "unflex/container/metadata.hpp"
#include "unflex/core/error.hpp"

namespace unflex::container {

enum class Kind { text, gzip, bgcode };

// The kind of a file by its first bytes. Fewer than kMagicBytes count as the whole file.
inline constexpr std::size_t kMagicBytes = 4;
[[nodiscard]] Kind detect(std::string_view head);

// The kind that a file of this name should have: gzip for .gz, binary for .bgcode and .bgc.
[[nodiscard]] Kind kind_of_name(std::string_view name);

// Unpacks a file step by step. Holds at most one block of a binary file, or 64 KiB of text of a
// gzip file, and the bytes it was given.
class Unpacker {
 public:
  virtual ~Unpacker() = default;

  // The next packed bytes; to be called when pull() has nothing to give.
  virtual void push(std::string_view bytes) = 0;
  // Says that there are no more bytes.
  virtual void finish() = 0;
  // The next piece of the text. Empty: more bytes are needed or, after finish(), the text is
  // complete. Errors are of kind input, have the file's name and tell where in the packed file they
  // are. Nothing more comes after an error.
  [[nodiscard]] virtual Result<std::string> pull() = 0;
  // The metadata of a binary file, complete at the end of its text; null for gzip.
  [[nodiscard]] virtual const Metadata* metadata() const { return nullptr; }
};

// name: what errors call the file. nullptr for Kind::text.
[[nodiscard]] std::unique_ptr<Unpacker> make_unpacker(Kind kind, std::string name);

class Packer {
 public:
  virtual ~Packer() = default;

  // Whether all of the text must go through survey() before the first push(), because the end of
  // the text is packed at the front.
  [[nodiscard]] virtual bool wants_survey() const { return false; }
  [[nodiscard]] virtual Status survey(std::string_view /*text*/) { return {}; }
  // Takes the next piece of the text, which need not consist of whole lines. Returns the packed
  // bytes that are ready.
  [[nodiscard]] virtual Result<std::string> push(std::string_view text) = 0;
  [[nodiscard]] virtual Result<std::string> finish() = 0;
};

// Equal texts always give equal bytes.
[[nodiscard]] std::unique_ptr<Packer> make_gzip_packer();

// The codes of Prusa's format.
enum class Compression : std::uint16_t { none, deflate, heatshrink_11_4, heatshrink_12_4 };
enum class Encoding : std::uint16_t { none, meatpack, meatpack_comments };

// The defaults are what PrusaSlicer 2.8 writes.
struct BgcodeOptions {
  Compression metadata = Compression::deflate;  // print and slicer metadata; others are not packed
  Compression gcode = Compression::heatshrink_12_4;
  Encoding encoding = Encoding::meatpack_comments;
  bool checksum = true;
};

// origin: metadata of the binary file from which the text was unpacked. The keys, their order and
// all values that the text does not give are taken from there. nullptr: slicers' comments are
// sorted into blocks as PrusaSlicer does. name: the result's name in errors.
[[nodiscard]] std::unique_ptr<Packer> make_bgcode_packer(std::string name, const Metadata* origin,
                                                         BgcodeOptions options = {});

}  // namespace unflex::container
