#include "bgcode_reader.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <utility>

#include "meatpack.hpp"
#include "metadata_text.hpp"

namespace unflex::container {
namespace {

// PrusaSlicer's blocks of G-code are of 64 KiB; a thumbnail or the settings of many extruders are
// larger, but nowhere near this.
constexpr std::size_t kMaxBlockBytes = std::size_t{16} << 20U;
constexpr std::size_t kMaxMetadataBytes = std::size_t{64} << 20U;

constexpr std::array<std::string_view, kBlockTypes> kTypeNames = {
    "file metadata",    "G-code",         "slicer metadata",
    "printer metadata", "print metadata", "thumbnail"};

// The rank of each type in the order of the file.
constexpr std::array<int, kBlockTypes> kRanks = {0, 5, 4, 1, 3, 2};

std::size_t index(BlockType type) { return static_cast<std::size_t>(type); }
int rank(BlockType type) { return kRanks[index(type)]; }

bool may_repeat(BlockType type) {
  // Slicer metadata: once as lines, once as JSON.
  return type == BlockType::thumbnail || type == BlockType::slicer || type == BlockType::gcode;
}

bool may_miss(BlockType type) { return type == BlockType::file || type == BlockType::thumbnail; }

}  // namespace

void BgcodeUnpacker::push(std::string_view bytes) {
  taken_ += next_;
  packed_.erase(0, next_);
  next_ = 0;
  packed_ += bytes;
}

Result<std::string> BgcodeUnpacker::pull() {
  if (!has_header_) {
    const Result<bool> taken = take_file_header();
    if (!taken) {
      return tl::unexpected(taken.error());
    }
    if (!*taken) {
      return ended_ ? Result<std::string>(cut_off()) : std::string();
    }
  }
  for (;;) {
    if (rest().empty()) {
      return ended_ ? end() : std::string();
    }
    const Result<std::optional<Block>> block = block_header();
    if (!block) {
      return tl::unexpected(block.error());
    }
    const bool whole =
        *block && rest().size() >= (*block)->bytes_before_checksum() + (has_checksums_ ? 4 : 0);
    if (!whole) {
      return ended_ ? Result<std::string>(cut_off()) : std::string();
    }
    Result<std::string> text = take_block(**block);
    if (!text || !text->empty()) {
      return text;
    }
  }
}

Result<bool> BgcodeUnpacker::take_file_header() {
  if (rest().size() < kFileHeaderBytes) {
    return false;
  }
  const std::uint32_t version = number(4, 4);
  if (version != kVersion) {
    return fail(
        ErrorKind::input, {name_, 0},
        fmt::format("is binary G-code of version {}, of which only 1 is known; export it as "
                    "plain G-code",
                    version));
  }
  const std::uint32_t checksum = number(8, 2);
  if (checksum > 1) {
    return fail(
        ErrorKind::input, {name_, 0},
        fmt::format("has checksums of the unknown type {}; export it as plain G-code", checksum));
  }
  has_checksums_ = checksum == 1;
  has_header_ = true;
  next_ += kFileHeaderBytes;
  return true;
}

Result<std::optional<BgcodeUnpacker::Block>> BgcodeUnpacker::block_header() const {
  if (rest().size() < 8) {
    return std::nullopt;
  }
  const std::uint32_t type = number(0, 2);
  if (type >= kBlockTypes) {
    return broken(fmt::format("has the unknown type {}", type));
  }
  const std::uint32_t compression = number(2, 2);
  if (compression >= kCompressions) {
    return broken(fmt::format("is packed in the unknown way {}", compression));
  }
  Block block;
  block.type = static_cast<BlockType>(type);
  block.compression = static_cast<Compression>(compression);
  const bool is_packed = block.compression != Compression::none;
  block.header_bytes = is_packed ? 12 : 8;
  if (rest().size() < block.header_bytes) {
    return std::nullopt;
  }
  block.size = number(4, 4);
  block.packed_size = is_packed ? number(8, 4) : block.size;
  block.parameter_bytes = block.type == BlockType::thumbnail ? 6 : 2;
  if (std::max(block.size, block.packed_size) > kMaxBlockBytes) {
    return broken(fmt::format("claims to be of {} bytes", std::max(block.size, block.packed_size)));
  }
  if (Status order = check_order(block.type); !order) {
    return tl::unexpected(order.error());
  }
  return block;
}

Status BgcodeUnpacker::check_order(BlockType type) const {
  const int before = last_ ? rank(*last_) : -1;
  const int now = rank(type);
  if (last_ && (now < before || (now == before && !may_repeat(type)))) {
    return broken(
        fmt::format("is {} behind {}", kTypeNames[index(type)], kTypeNames[index(*last_)]));
  }
  for (std::size_t other = 0; other < kBlockTypes; ++other) {
    const auto missing = static_cast<BlockType>(other);
    if (rank(missing) > before && rank(missing) < now && !may_miss(missing)) {
      return broken(fmt::format("is {}, but there is no {} before it", kTypeNames[index(type)],
                                kTypeNames[other]));
    }
  }
  return {};
}

Result<std::string> BgcodeUnpacker::take_block(const Block& block) {
  const std::size_t length = block.bytes_before_checksum();
  if (has_checksums_ && crc32_of(rest().substr(0, length)) != number(length, 4)) {
    return broken("does not match its checksum");
  }
  std::optional<std::string> data = decompress(
      rest().substr(length - block.packed_size, block.packed_size), block.compression, block.size);
  if (!data) {
    return broken("cannot be unpacked");
  }
  const auto parameter = static_cast<std::uint16_t>(number(block.header_bytes, 2));
  Result<std::string> text = std::string();
  if (block.type == BlockType::gcode) {
    text = gcode_text(parameter, std::move(*data));
    if (text && last_ != BlockType::gcode) {
      text->insert(0, head_text(metadata_));
    }
  } else if (Status kept = take_metadata(block, parameter, std::move(*data)); !kept) {
    return tl::unexpected(kept.error());
  }
  if (text) {
    last_ = block.type;
    ends_line_ = text->empty() ? ends_line_ : text->ends_with('\n');
    next_ += length + (has_checksums_ ? 4 : 0);
  }
  return text;
}

Result<std::string> BgcodeUnpacker::gcode_text(std::uint16_t encoding, std::string data) const {
  if (encoding >= kEncodings) {
    return broken(fmt::format("is encoded in the unknown way {}", encoding));
  }
  return static_cast<Encoding>(encoding) == Encoding::none ? std::move(data) : unmeatpack(data);
}

Status BgcodeUnpacker::take_metadata(const Block& block, std::uint16_t encoding, std::string data) {
  metadata_bytes_ += data.size();
  if (metadata_bytes_ > kMaxMetadataBytes) {
    return broken(fmt::format("is the one with which metadata exceed {} bytes", kMaxMetadataBytes));
  }
  if (block.type == BlockType::thumbnail) {
    if (encoding >= kThumbnailFormats) {
      return broken(fmt::format("is a thumbnail of the unknown format {}", encoding));
    }
    const auto size = [&](std::size_t at) {
      return static_cast<std::uint16_t>(number(block.header_bytes + at, 2));
    };
    metadata_.thumbnails.push_back({encoding, size(2), size(4), std::move(data)});
    return {};
  }
  if (encoding != kIni && !(encoding == kJson && block.type == BlockType::slicer)) {
    return broken(fmt::format("is metadata in the unknown encoding {}", encoding));
  }
  if (block.type == BlockType::file) {
    metadata_.file = std::move(data);
  } else if (block.type == BlockType::slicer) {
    std::string& kept = encoding == kJson ? metadata_.slicer_json : metadata_.slicer;
    if (!kept.empty()) {
      return broken("is slicer metadata for a second time");
    }
    kept = std::move(data);
  } else {
    std::optional<KeyValues> values = key_values(data);
    if (!values) {
      return broken("has a line that is not key=value");
    }
    (block.type == BlockType::print ? metadata_.print : metadata_.printer) = std::move(*values);
  }
  return {};
}

Result<std::string> BgcodeUnpacker::end() {
  if (is_done_) {
    return std::string();
  }
  if (last_ != BlockType::gcode) {
    return fail(ErrorKind::input, {name_, 0},
                fmt::format("ends at byte {} without any G-code; get the whole file", place()));
  }
  is_done_ = true;
  std::string text = tail_text(metadata_);
  return ends_line_ ? text : text.insert(0, 1, '\n');
}

std::uint32_t BgcodeUnpacker::number(std::size_t at, std::size_t bytes) const {
  std::uint32_t value = 0;
  for (std::size_t i = bytes; i-- > 0;) {
    value = value << 8U | static_cast<unsigned char>(packed_[next_ + at + i]);
  }
  return value;
}

tl::unexpected<Error> BgcodeUnpacker::broken(std::string_view message) const {
  return fail(
      ErrorKind::input, {name_, 0},
      fmt::format("block at byte {} {}; the file is damaged, export it again", place(), message));
}

tl::unexpected<Error> BgcodeUnpacker::cut_off() const {
  return fail(ErrorKind::input, {name_, 0},
              has_header_
                  ? fmt::format("ends at byte {}, within the block at byte {}; get the whole file",
                                taken_ + packed_.size(), place())
                  : fmt::format("ends at byte {}, within its header; get the whole file",
                                taken_ + packed_.size()));
}

}  // namespace unflex::container
