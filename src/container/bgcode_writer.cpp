#include <functional>
#include <optional>
#include <utility>

#include "bgcode_format.hpp"
#include "meatpack.hpp"
#include "metadata_text.hpp"
#include "unflex/container/container.hpp"

namespace unflex::container {
namespace {

// The longest line that unflex reads (docs/gcode.md).
constexpr std::size_t kLongestLineBytes = std::size_t{1} << 20U;

void put(std::string& bytes, std::uint32_t value, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    bytes += static_cast<char>(value >> (8 * i) & 255U);
  }
}

// The line without the carriage returns at its end; some tools leave several.
std::string_view without_end(std::string_view line) {
  return line.substr(0, line.find_last_not_of('\r') + 1);
}

// Cuts a text that comes in pieces into lines, without their ends.
class Lines {
 public:
  using Use = std::function<Status(std::string_view line)>;

  Status push(std::string_view text, const Use& use) {
    for (std::size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n')) {
      Status used;
      if (begun_.empty()) {
        used = use(without_end(text.substr(0, end)));
      } else {
        begun_ += text.substr(0, end);
        used = use(without_end(begun_));
        begun_.clear();
      }
      if (!used) {
        return used;
      }
      text.remove_prefix(end + 1);
    }
    begun_ += text;
    if (begun_.size() > kLongestLineBytes) {
      return fail(ErrorKind::input, "the print has a line longer than 1 MiB; write plain G-code");
    }
    return {};
  }

  Status finish(const Use& use) {
    Status used = begun_.empty() ? Status{} : use(without_end(begun_));
    begun_.clear();
    return used;
  }

 private:
  std::string begun_;
};

class BgcodePacker final : public Packer {
 public:
  BgcodePacker(std::string name, const Metadata* origin, BgcodeOptions options)
      : name_(std::move(name)), options_(options), origin_(origin), surveyed_(origin) {}

  [[nodiscard]] bool wants_survey() const override { return true; }

  Status survey(std::string_view text) override {
    return named(lines_.push(text, [this](std::string_view line) { return look_at(line); }));
  }

  Result<std::string> push(std::string_view text) override {
    return begin()
        .and_then([&] {
          return named(lines_.push(text, [this](std::string_view line) { return add(line); }));
        })
        .map([this] { return std::exchange(packed_, {}); });
  }

  Result<std::string> finish() override {
    return begin()
        .and_then([&] {
          return named(lines_.finish([this](std::string_view line) { return add(line); }));
        })
        .map([this] {
          end_gcode_block();
          return std::exchange(packed_, {});
        });
  }

 private:
  Status look_at(std::string_view line) {
    return surveyed_.is_gcode(line).map([](bool) {});
  }

  // Ends the survey and writes all metadata, which come before the G-code.
  Status begin() {
    if (has_begun_) {
      return {};
    }
    has_begun_ = true;
    const Result<Metadata> metadata =
        lines_.finish([this](std::string_view line) { return look_at(line); }).and_then([this] {
          return surveyed_.take();
        });
    sorted_.emplace(origin_, surveyed_);
    if (!metadata) {
      return named(tl::unexpected(metadata.error()));
    }
    packed_ += kBgcodeMagic;
    put(packed_, kVersion, 4);
    put(packed_, options_.checksum ? 1 : 0, 2);
    put_metadata(*metadata);
    return {};
  }

  void put_metadata(const Metadata& metadata) {
    if (!metadata.file.empty()) {
      put_block(BlockType::file, Compression::none, {kIni}, metadata.file);
    }
    put_block(BlockType::printer, Compression::none, {kIni}, lines_of(metadata.printer));
    for (const Thumbnail& thumbnail : metadata.thumbnails) {
      put_block(BlockType::thumbnail, Compression::none,
                {thumbnail.format, thumbnail.width, thumbnail.height}, thumbnail.data);
    }
    put_block(BlockType::print, options_.metadata, {kIni}, lines_of(metadata.print));
    if (!metadata.slicer.empty() || metadata.slicer_json.empty()) {
      put_block(BlockType::slicer, options_.metadata, {kIni}, metadata.slicer);
    }
    if (!metadata.slicer_json.empty()) {
      put_block(BlockType::slicer, options_.metadata, {kJson}, metadata.slicer_json);
    }
  }

  void put_block(BlockType type, Compression compression,
                 std::initializer_list<std::uint16_t> parameters, std::string_view data) {
    // Empty data are not packed: some readers fail to unpack them.
    compression = data.empty() ? Compression::none : compression;
    std::string block;
    put(block, static_cast<std::uint32_t>(type), 2);
    put(block, static_cast<std::uint32_t>(compression), 2);
    put(block, static_cast<std::uint32_t>(data.size()), 4);
    const std::string packed = compress(data, compression);
    if (compression != Compression::none) {
      put(block, static_cast<std::uint32_t>(packed.size()), 4);
    }
    for (const std::uint16_t parameter : parameters) {
      put(block, parameter, 2);
    }
    block += packed;
    if (options_.checksum) {
      put(block, crc32_of(block), 4);
    }
    packed_ += block;
  }

  Status add(std::string_view line) {
    const Result<bool> kept = sorted_->is_gcode(line);
    if (!kept || !*kept) {
      return kept.map([](bool) {});
    }
    if (line.size() + 1 > kGcodeBlockBytes) {
      return fail(ErrorKind::input,
                  "the print has a line longer than a block of binary G-code, 64 KiB; write plain "
                  "G-code");
    }
    if (gcode_.size() + line.size() + 1 > kGcodeBlockBytes) {
      end_gcode_block();
    }
    (gcode_ += line) += '\n';
    return {};
  }

  void end_gcode_block() {
    // Every file has at least one block of G-code. A block with a byte 0xFF stays unencoded,
    // because two such bytes are a command in MeatPack.
    if (gcode_.empty() && has_gcode_) {
      return;
    }
    const bool packable = gcode_.find('\xff') == std::string::npos && !gcode_.empty();
    const Encoding encoding = packable ? options_.encoding : Encoding::none;
    const auto code = static_cast<std::uint16_t>(encoding);
    if (encoding == Encoding::none) {
      put_block(BlockType::gcode, options_.gcode, {code}, gcode_);
    } else {
      put_block(BlockType::gcode, options_.gcode, {code},
                meatpack(gcode_, encoding == Encoding::meatpack_comments));
    }
    gcode_.clear();
    has_gcode_ = true;
  }

  [[nodiscard]] Status named(Status status) const {
    return status.map_error([this](Error error) {
      error.place.file = name_;
      return error;
    });
  }

  std::string name_;
  BgcodeOptions options_;
  const Metadata* origin_;
  MetadataLines surveyed_;
  std::optional<MetadataLines> sorted_;  // says a second time which lines are metadata
  Lines lines_;
  bool has_begun_ = false;
  bool has_gcode_ = false;
  std::string gcode_;   // lines of the block to come
  std::string packed_;  // blocks not handed out yet
};

}  // namespace

std::unique_ptr<Packer> make_bgcode_packer(std::string name, const Metadata* origin,
                                           BgcodeOptions options) {
  return std::make_unique<BgcodePacker>(std::move(name), origin, options);
}

}  // namespace unflex::container
