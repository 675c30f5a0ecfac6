#include <array>
#include <cerrno>
#include <istream>
#include <ostream>
#include <streambuf>
#include <utility>

#include "close_descriptor.hpp"
#include "unflex/platform/descriptors.hpp"
#include "unflex/platform/folders.hpp"

namespace unflex::platform {
namespace {

tl::expected<std::size_t, int> outcome(std::ptrdiff_t count) {
  if (count < 0) {
    return tl::unexpected(errno);
  }
  return static_cast<std::size_t>(count);
}

class DescriptorSource final : public ByteSource {
 public:
  explicit DescriptorSource(int descriptor) : descriptor_(descriptor) {}
  [[nodiscard]] bool wait(std::chrono::milliseconds most) override {
    return wait_to_read(descriptor_, most);
  }
  [[nodiscard]] tl::expected<std::size_t, int> read(char* to, std::size_t room) override {
    return outcome(read_bytes(descriptor_, to, room));
  }

 private:
  int descriptor_;
};

class DescriptorSink final : public ByteSink {
 public:
  explicit DescriptorSink(int descriptor) : descriptor_(descriptor) {}
  [[nodiscard]] bool wait(std::chrono::milliseconds most) override {
    return wait_to_write(descriptor_, most);
  }
  [[nodiscard]] tl::expected<std::size_t, int> write(std::string_view bytes) override {
    return outcome(write_bytes(descriptor_, bytes));
  }

 private:
  int descriptor_;
};

// Reads a file from its beginning, beside others that do.
class TextBuffer final : public std::streambuf {
 public:
  explicit TextBuffer(int descriptor) : descriptor_(descriptor) {}

 protected:
  int_type underflow() override {
    const std::ptrdiff_t count = read_bytes_at(descriptor_, block_.data(), block_.size(), end_);
    if (count <= 0) {
      return traits_type::eof();
    }
    end_ += static_cast<std::uint64_t>(count);
    setg(block_.data(), block_.data(), block_.data() + count);
    return traits_type::to_int_type(*gptr());
  }
  pos_type seekoff(off_type offset, std::ios::seekdir from, std::ios::openmode /*which*/) override {
    off_type base = 0;
    if (from == std::ios::cur) {
      base = static_cast<off_type>(end_) - (egptr() - gptr());
    } else if (from == std::ios::end) {
      const tl::expected<FileState, int> state = state_of(descriptor_);
      base = state ? static_cast<off_type>(state->bytes) : 0;
    }
    if (base + offset < 0) {
      return pos_type(off_type(-1));
    }
    end_ = static_cast<std::uint64_t>(base + offset);
    setg(nullptr, nullptr, nullptr);
    return pos_type(base + offset);
  }
  pos_type seekpos(pos_type place, std::ios::openmode which) override {
    return seekoff(off_type(place), std::ios::beg, which);
  }

 private:
  int descriptor_;
  std::uint64_t end_ = 0;  // of the block, in the file
  std::array<char, 65536> block_{};
};

class TextStream final : public std::istream {
 public:
  explicit TextStream(int descriptor) : std::istream(nullptr), buffer_(descriptor) {
    rdbuf(&buffer_);
  }

 private:
  TextBuffer buffer_;
};

class DescriptorText final : public TextStore {
 public:
  explicit DescriptorText(int descriptor) : descriptor_(descriptor) {}

  [[nodiscard]] std::unique_ptr<std::istream> read() const override {
    return std::make_unique<TextStream>(descriptor_);
  }
  [[nodiscard]] std::unique_ptr<std::ostream> write() override {
    return std::make_unique<std::ostream>(nullptr);
  }
  [[nodiscard]] bool rewrite(const LineChange& /*change*/) override { return false; }
  [[nodiscard]] std::optional<std::uint64_t> bytes() const override {
    const tl::expected<FileState, int> state = state_of(descriptor_);
    return state ? std::optional(state->bytes) : std::nullopt;
  }

 private:
  int descriptor_;
};

}  // namespace

FileDescriptor FileDescriptor::borrowed(int fd) {
  FileDescriptor descriptor(fd);
  descriptor.is_borrowed_ = true;
  return descriptor;
}

FileDescriptor::FileDescriptor(FileDescriptor&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), is_borrowed_(other.is_borrowed_) {}

FileDescriptor& FileDescriptor::operator=(FileDescriptor&& other) noexcept {
  std::swap(fd_, other.fd_);
  std::swap(is_borrowed_, other.is_borrowed_);
  return *this;
}

FileDescriptor::~FileDescriptor() {
  if (valid() && !is_borrowed_) {
    close_descriptor(fd_);
  }
}

std::shared_ptr<ByteSource> descriptor_source(int descriptor) {
  return std::make_shared<DescriptorSource>(descriptor);
}

std::shared_ptr<ByteSink> descriptor_sink(int descriptor) {
  return std::make_shared<DescriptorSink>(descriptor);
}

std::shared_ptr<TextStore> descriptor_text(int descriptor) {
  return std::make_shared<DescriptorText>(descriptor);
}

}  // namespace unflex::platform
