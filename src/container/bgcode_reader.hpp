// Binary G-code to the text that PrusaSlicer would have written. The settings that printers read
// and the thumbnails come first, then the G-code, then times, filament and settings. All but the
// G-code are comments.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "bgcode_format.hpp"
#include "unflex/container/container.hpp"

namespace unflex::container {

class BgcodeUnpacker final : public Unpacker {
 public:
  explicit BgcodeUnpacker(std::string name) : name_(std::move(name)) {}

  void push(std::string_view bytes) override;
  void finish() override { ended_ = true; }
  Result<std::string> pull() override;
  [[nodiscard]] const Metadata* metadata() const override { return &metadata_; }

 private:
  struct Block {
    BlockType type = BlockType::file;
    Compression compression = Compression::none;
    std::size_t size = 0;         // size of the unpacked data
    std::size_t packed_size = 0;  // size of the data in the file
    std::size_t header_bytes = 0;
    std::size_t parameter_bytes = 0;
    [[nodiscard]] std::size_t bytes_before_checksum() const {
      return header_bytes + parameter_bytes + packed_size;
    }
  };

  // Each function does one step. When it returns, the packed bytes that it took are dealt with.
  Result<bool> take_file_header();
  Result<std::optional<Block>> block_header() const;
  Status check_order(BlockType type) const;
  Result<std::string> take_block(const Block& block);
  Status take_metadata(const Block& block, std::uint16_t encoding, std::string data);
  Result<std::string> gcode_text(std::uint16_t encoding, std::string data) const;
  Result<std::string> end();

  [[nodiscard]] std::string_view rest() const { return std::string_view(packed_).substr(next_); }
  [[nodiscard]] std::size_t place() const { return taken_ + next_; }
  [[nodiscard]] std::uint32_t number(std::size_t at, std::size_t bytes) const;
  [[nodiscard]] tl::unexpected<Error> broken(std::string_view message) const;
  [[nodiscard]] tl::unexpected<Error> cut_off() const;

  std::string name_;
  std::string packed_;
  std::size_t next_ = 0;   // first byte of packed_ that is not dealt with
  std::size_t taken_ = 0;  // bytes before packed_
  bool ended_ = false;
  bool has_header_ = false;
  bool has_checksums_ = false;
  bool is_done_ = false;
  bool ends_line_ = true;  // whether the text so far ends with a line end
  std::size_t metadata_bytes_ = 0;
  std::optional<BlockType> last_;
  Metadata metadata_;
};

}  // namespace unflex::container
