// What G-code comes packed in: gzip (RFC 1952) and Prusa's binary G-code. Bytes in, text out, and
// the reverse, in pieces and with bounded memory; nothing here reads or writes a file.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "unflex/container/metadata.hpp"
#include "unflex/core/error.hpp"

namespace unflex::container {

enum class Kind { text, gzip, bgcode };

// By its first bytes; fewer than kMagicBytes are taken for all there is.
inline constexpr std::size_t kMagicBytes = 4;
[[nodiscard]] Kind detect(std::string_view head);

// What a file of that name is expected to be: gzip for .gz, binary for .bgcode and .bgc.
[[nodiscard]] Kind kind_of_name(std::string_view name);

// Holds at most one block of a binary file, 64 KiB of text of a gzip file, and what it was given.
class Unpacker {
 public:
  virtual ~Unpacker() = default;

  // The next packed bytes; to be called when pull() has nothing to give.
  virtual void push(std::string_view bytes) = 0;
  // There are no more.
  virtual void finish() = 0;
  // The next piece of the text. Empty: wants more bytes or, after finish(), that was all. Errors
  // are of kind input, have the file's name and tell where in the packed file they are; there is
  // nothing to be had after one.
  [[nodiscard]] virtual Result<std::string> pull() = 0;
  // What a binary file says beside its G-code, complete at the end of its text; null for gzip.
  [[nodiscard]] virtual const Metadata* metadata() const { return nullptr; }
};

// name: what errors call the file. Of Kind::text there is none: nullptr.
[[nodiscard]] std::unique_ptr<Unpacker> make_unpacker(Kind kind, std::string name);

class Packer {
 public:
  virtual ~Packer() = default;

  // Whether all of the text must have gone to survey() before the first push(), since what stands
  // at its end is packed at the front.
  [[nodiscard]] virtual bool wants_survey() const { return false; }
  [[nodiscard]] virtual Status survey(std::string_view /*text*/) { return {}; }
  // The next piece of the text, not necessarily of whole lines; the packed bytes that are ready.
  [[nodiscard]] virtual Result<std::string> push(std::string_view text) = 0;
  [[nodiscard]] virtual Result<std::string> finish() = 0;
};

// The same text makes the same bytes, always.
[[nodiscard]] std::unique_ptr<Packer> make_gzip_packer();

// The codes of Prusa's format.
enum class Compression : std::uint16_t { none, deflate, heatshrink_11_4, heatshrink_12_4 };
enum class Encoding : std::uint16_t { none, meatpack, meatpack_comments };

// By default as PrusaSlicer 2.8 writes.
struct BgcodeOptions {
  Compression metadata = Compression::deflate;  // of print and slicer; the others are not packed
  Compression gcode = Compression::heatshrink_12_4;
  Encoding encoding = Encoding::meatpack_comments;
  bool checksum = true;
};

// origin: of the binary file the text was unpacked from; keys, their order and all values the text
// does not have otherwise are taken from there. Without it what slicers say in comments is sorted
// into blocks as PrusaSlicer does. name: what errors call the result.
[[nodiscard]] std::unique_ptr<Packer> make_bgcode_packer(std::string name, const Metadata* origin,
                                                         BgcodeOptions options = {});

}  // namespace unflex::container
