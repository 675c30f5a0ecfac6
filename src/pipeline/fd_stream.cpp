#include "fd_stream.hpp"

#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <ios>

namespace unflex::pipeline {
namespace {

constexpr std::size_t kBlockBytes = 256 * 1024;
// How often a wait is interrupted to see whether it is still wanted.
constexpr int kPatience_ms = 50;

// Whether the descriptor is ready; false when cancelled.
bool ready(int fd, short events, const Progress& progress, CpuSlots& slots) {
  pollfd what{fd, events, 0};
  if (poll(&what, 1, 0) > 0) {
    return true;
  }
  const CpuSlot::Without without(slots);
  while (!progress.cancelled()) {
    const int count = poll(&what, 1, kPatience_ms);
    if (count > 0 || (count < 0 && errno != EINTR)) {
      return true;  // an error shows when it is read or written
    }
  }
  return false;
}

}  // namespace

FdSource::int_type FdSource::underflow() {
  block_.resize(kBlockBytes);
  for (;;) {
    if (!ready(fd_, POLLIN, *progress_, *slots_)) {
      return traits_type::eof();
    }
    const ssize_t count = read(fd_, block_.data(), block_.size());
    if (count > 0) {
      setg(block_.data(), block_.data(), block_.data() + count);
      return traits_type::to_int_type(*gptr());
    }
    if (count == 0) {
      return traits_type::eof();
    }
    if (errno != EINTR && errno != EAGAIN) {
      // Makes the stream bad.
      throw std::ios_base::failure("cannot read");
    }
  }
}

std::streamsize FdSink::xsputn(const char* text, std::streamsize count) {
  std::streamsize written = 0;
  while (written < count && ready(fd_, POLLOUT, *progress_, *slots_)) {
    const ssize_t some = write(fd_, text + written, static_cast<std::size_t>(count - written));
    if (some > 0) {
      written += some;
    } else if (some < 0 && errno != EINTR && errno != EAGAIN) {
      error_ = errno;
      break;
    }
  }
  return written;
}

FdSink::int_type FdSink::overflow(int_type character) {
  if (traits_type::eq_int_type(character, traits_type::eof())) {
    return traits_type::not_eof(character);
  }
  const char text = traits_type::to_char_type(character);
  return xsputn(&text, 1) == 1 ? character : traits_type::eof();
}

}  // namespace unflex::pipeline
