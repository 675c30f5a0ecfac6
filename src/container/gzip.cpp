#include "gzip.hpp"

#include <fmt/core.h>
#include <zlib.h>

#include <new>
#include <utility>

namespace unflex::container {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 16U;
// zlib: a window of 2^15 bytes; the 16 asks for gzip's wrapping instead of zlib's own.
constexpr int kWindowBits = 15 + 16;
constexpr int kMemoryLevel = 8;

const Bytef* bytes_of(std::string_view text) { return reinterpret_cast<const Bytef*>(text.data()); }

class GzipUnpacker final : public Unpacker {
 public:
  explicit GzipUnpacker(std::string name) : name_(std::move(name)) {
    if (inflateInit2(&stream_, kWindowBits) != Z_OK) {
      throw std::bad_alloc();
    }
  }
  GzipUnpacker(const GzipUnpacker&) = delete;
  GzipUnpacker& operator=(const GzipUnpacker&) = delete;
  ~GzipUnpacker() override { inflateEnd(&stream_); }

  void push(std::string_view bytes) override {
    taken_ += next_;
    packed_.erase(0, next_);
    next_ = 0;
    packed_ += bytes;
  }

  void finish() override { ended_ = true; }

  Result<std::string> pull() override {
    std::string text;
    while (text.empty()) {
      if (Status ready = begin_member(); !ready) {
        return tl::unexpected(ready.error());
      }
      if (!in_member_ || (next_ == packed_.size() && !ended_)) {
        break;
      }
      if (Status inflated = inflate_into(text); !inflated) {
        return tl::unexpected(inflated.error());
      }
    }
    return text;
  }

 private:
  // Between members: another member may follow, or zeros that fill up a block of a tape, or the
  // end.
  Status begin_member() {
    while (!in_member_ && next_ < packed_.size()) {
      const std::string_view rest = std::string_view(packed_).substr(next_);
      if (members_ > 0 && rest.front() == '\0') {
        padded_ = true;
        ++next_;
      } else if (!padded_ &&
                 (rest.starts_with(kGzipMagic) || (rest == kGzipMagic.substr(0, 1) && !ended_))) {
        if (rest.size() < kGzipMagic.size()) {
          return {};
        }
        in_member_ = true;
        inflateReset(&stream_);
      } else {
        return broken(
            fmt::format("after the gzip data comes something else (byte {}); cut it off "
                        "or get the file again",
                        taken_ + next_));
      }
    }
    return {};
  }

  Status inflate_into(std::string& text) {
    text.resize(kPieceBytes);
    stream_.next_in = const_cast<Bytef*>(bytes_of(packed_) + next_);
    stream_.avail_in = static_cast<uInt>(packed_.size() - next_);
    stream_.next_out = reinterpret_cast<Bytef*>(text.data());
    stream_.avail_out = static_cast<uInt>(text.size());
    const int outcome = inflate(&stream_, Z_NO_FLUSH);
    next_ = packed_.size() - stream_.avail_in;
    text.resize(text.size() - stream_.avail_out);
    if (outcome == Z_STREAM_END) {
      in_member_ = false;
      ++members_;
      return {};
    }
    if (outcome == Z_BUF_ERROR || (outcome == Z_OK && text.empty() && next_ == packed_.size())) {
      return ended_ && text.empty()
                 ? broken(
                       fmt::format("the gzip data end too early (at byte {}); get the whole file",
                                   taken_ + next_))
                 : Status{};
    }
    if (outcome == Z_MEM_ERROR) {
      return fail(ErrorKind::internal, {name_, 0}, "out of memory; end other programs");
    }
    if (outcome != Z_OK) {
      return broken(fmt::format("the gzip data are damaged near byte {} ({}); get the file again",
                                taken_ + next_, stream_.msg == nullptr ? "zlib" : stream_.msg));
    }
    return {};
  }

  [[nodiscard]] tl::unexpected<Error> broken(std::string message) const {
    return fail(ErrorKind::input, {name_, 0}, std::move(message));
  }

  std::string name_;
  z_stream stream_{};
  std::string packed_;
  std::size_t next_ = 0;   // first byte of packed_ that zlib has not taken yet
  std::size_t taken_ = 0;  // bytes before packed_
  std::size_t members_ = 0;
  bool in_member_ = false;
  bool padded_ = false;
  bool ended_ = false;
};

// Level, window and header are fixed, the time stamp is left out: equal texts give equal bytes.
class GzipPacker final : public Packer {
 public:
  GzipPacker() {
    if (deflateInit2(&stream_, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kWindowBits, kMemoryLevel,
                     Z_DEFAULT_STRATEGY) != Z_OK) {
      throw std::bad_alloc();
    }
  }
  GzipPacker(const GzipPacker&) = delete;
  GzipPacker& operator=(const GzipPacker&) = delete;
  ~GzipPacker() override { deflateEnd(&stream_); }

  Result<std::string> push(std::string_view text) override {
    std::string packed;
    while (!text.empty()) {
      // The reader of a pipe gets every 64 KiB of text as soon as they are complete, wherever the
      // pushes were cut.
      const std::string_view piece = text.substr(0, kPieceBytes - since_flush_);
      text.remove_prefix(piece.size());
      since_flush_ += piece.size();
      const bool full = since_flush_ == kPieceBytes;
      since_flush_ = full ? 0 : since_flush_;
      deflate_piece(piece, full ? Z_SYNC_FLUSH : Z_NO_FLUSH, packed);
    }
    return packed;
  }

  Result<std::string> finish() override {
    std::string packed;
    deflate_piece({}, Z_FINISH, packed);
    return packed;
  }

 private:
  void deflate_piece(std::string_view piece, int flush, std::string& packed) {
    stream_.next_in = const_cast<Bytef*>(bytes_of(piece));
    stream_.avail_in = static_cast<uInt>(piece.size());
    do {
      const std::size_t before = packed.size();
      packed.resize(before + kPieceBytes);
      stream_.next_out = reinterpret_cast<Bytef*>(packed.data() + before);
      stream_.avail_out = static_cast<uInt>(kPieceBytes);
      deflate(&stream_, flush);
      packed.resize(before + kPieceBytes - stream_.avail_out);
    } while (stream_.avail_out == 0);
  }

  z_stream stream_{};
  std::size_t since_flush_ = 0;
};

}  // namespace

std::unique_ptr<Unpacker> make_gzip_unpacker(std::string name) {
  return std::make_unique<GzipUnpacker>(std::move(name));
}

std::unique_ptr<Packer> make_gzip_packer() { return std::make_unique<GzipPacker>(); }

}  // namespace unflex::container
