// Streams of bytes whose other side may not be ready, such as pipes.
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

  // Waits until there is something to read, which may be the end or an error, but no longer than
  // `most`. Returns false if there is nothing yet.
  [[nodiscard]] virtual bool wait(std::chrono::milliseconds most) = 0;
  // Reads at most `room` bytes to `to` and returns their number, which is 0 at the end. If reading
  // fails, it returns the errno. EINTR and EAGAIN mean that another try is worth it.
  [[nodiscard]] virtual tl::expected<std::size_t, int> read(char* to, std::size_t room) = 0;
};

class ByteSink {
 public:
  ByteSink() = default;
  ByteSink(const ByteSink&) = delete;
  ByteSink& operator=(const ByteSink&) = delete;
  virtual ~ByteSink() = default;

  // Waits until something can be written or an error is known, but no longer than `most`.
  [[nodiscard]] virtual bool wait(std::chrono::milliseconds most) = 0;
  // Writes some of the bytes and returns how many. If writing fails, it returns the errno. EINTR
  // and EAGAIN mean that another try is worth it.
  [[nodiscard]] virtual tl::expected<std::size_t, int> write(std::string_view bytes) = 0;
};

}  // namespace unflex
