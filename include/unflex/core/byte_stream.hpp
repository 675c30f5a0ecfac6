// Bytes that come, or are taken, when the other side is ready, as those of a pipe.
#pragma once

#include <chrono>
#include <cstddef>
#include <string_view>
#include <tl/expected.hpp>

namespace unflex {

class ByteSource {
 public:
  ByteSource() = default;
  ByteSource(const ByteSource&) = delete;
  ByteSource& operator=(const ByteSource&) = delete;
  virtual ~ByteSource() = default;

  // Waits no longer than this until there is something to read, be it the end or an error. False if
  // there is nothing yet.
  [[nodiscard]] virtual bool wait(std::chrono::milliseconds most) = 0;
  // Puts what can be read at `to`, at most `room` bytes, and returns how many: 0 at the end. Or the
  // errno of what went wrong, which is EINTR or EAGAIN if it is worth another try.
  [[nodiscard]] virtual tl::expected<std::size_t, int> read(char* to, std::size_t room) = 0;
};

class ByteSink {
 public:
  ByteSink() = default;
  ByteSink(const ByteSink&) = delete;
  ByteSink& operator=(const ByteSink&) = delete;
  virtual ~ByteSink() = default;

  // Waits no longer than this until something can be written, or an error is known.
  [[nodiscard]] virtual bool wait(std::chrono::milliseconds most) = 0;
  // Writes some of the bytes and returns how many, or the errno of what went wrong, as above.
  [[nodiscard]] virtual tl::expected<std::size_t, int> write(std::string_view bytes) = 0;
};

}  // namespace unflex
