#include "fd_stream.hpp"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <functional>
#include <ios>
#include <string_view>
#include <utility>

namespace unflex::pipeline {
namespace {

constexpr std::size_t kBlockBytes = 256 * 1024;
// How often a wait is interrupted to see whether it is still wanted.
constexpr int kPatience_ms = 50;

// Waits until the descriptor is ready; false once it is unwanted.
bool ready(int fd, short events, CpuSlots& slots, const std::function<bool()>& is_unwanted) {
  pollfd what{fd, events, 0};
  if (poll(&what, 1, 0) > 0) {
    return true;
  }
  const CpuSlot::Without without(slots);
  while (!is_unwanted()) {
    const int count = poll(&what, 1, kPatience_ms);
    if (count > 0 || (count < 0 && errno != EINTR)) {
      return true;  // an error shows when it is read or written
    }
  }
  return false;
}

}  // namespace

FdSource::FdSource(const Job& job, const Progress& progress, CpuSlots& slots)
    : fd_(job.input_fd), progress_(&progress), slots_(&slots), block_(job.input_head) {
  if (fd_ >= 0) {
    unpacker_ = container::make_unpacker(job.input_fd_kind, job.input_name);
  }
  if (unpacker_) {
    unpacker_->push(block_);
  } else {
    setg(block_.data(), block_.data(), block_.data() + block_.size());
  }
}

bool FdSource::read_block() {
  block_.resize(kBlockBytes);
  while (!stopped_ && ready(fd_, POLLIN, *slots_, [this] { return is_unwanted(); })) {
    const ssize_t count = read(fd_, block_.data(), block_.size());
    if (count >= 0) {
      block_.resize(static_cast<std::size_t>(count));
      return count > 0;
    }
    if (errno != EINTR && errno != EAGAIN) {
      // The stream catches this and becomes bad.
      throw std::ios_base::failure("cannot read");
    }
  }
  return false;
}

bool FdSource::unpack_block() {
  for (bool more = true;;) {
    Result<std::string> text = unpacker_->pull();
    if (!text) {
      error_ = text.error();
      throw std::ios_base::failure("cannot unpack");
    }
    if (!text->empty() || !more) {
      text_ = std::move(*text);
      return !text_.empty();
    }
    more = read_block();
    if (more) {
      unpacker_->push(block_);
    } else if (is_unwanted()) {
      return false;
    } else {
      unpacker_->finish();
    }
  }
}

FdSource::int_type FdSource::underflow() {
  if (!(unpacker_ ? unpack_block() : read_block())) {
    return traits_type::eof();
  }
  std::string& text = unpacker_ ? text_ : block_;
  setg(text.data(), text.data(), text.data() + text.size());
  return traits_type::to_int_type(*gptr());
}

FdSink::FdSink(const Job& job, const Progress& progress, CpuSlots& slots)
    : fd_(job.output_fd), progress_(&progress), slots_(&slots) {
  if (fd_ >= 0 && job.output_fd_kind == container::Kind::gzip) {
    packer_ = container::make_gzip_packer();
  }
}

bool FdSink::write_out(std::string_view bytes) {
  const auto cancelled = [this] { return progress_->cancelled(); };
  while (!bytes.empty() && ready(fd_, POLLOUT, *slots_, cancelled)) {
    const ssize_t some = write(fd_, bytes.data(), bytes.size());
    if (some > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(some));
    } else if (some < 0 && errno != EINTR && errno != EAGAIN) {
      error_ = errno;
      break;
    }
  }
  is_whole_ = is_whole_ && bytes.empty();
  return bytes.empty();
}

// Gzip cannot fail to pack.
std::streamsize FdSink::xsputn(const char* text, std::streamsize count) {
  const std::string_view piece(text, static_cast<std::size_t>(count));
  const bool written = packer_ ? write_out(*packer_->push(piece)) : write_out(piece);
  return written ? count : 0;
}

bool FdSink::finish() {
  if (packer_ && is_whole_) {
    write_out(*packer_->finish());
  }
  return is_whole_;
}

FdSink::int_type FdSink::overflow(int_type character) {
  if (traits_type::eq_int_type(character, traits_type::eof())) {
    return traits_type::not_eof(character);
  }
  const char text = traits_type::to_char_type(character);
  return xsputn(&text, 1) == 1 ? character : traits_type::eof();
}

}  // namespace unflex::pipeline
