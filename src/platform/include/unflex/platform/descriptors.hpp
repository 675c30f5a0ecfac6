// Open files, pipes and devices by the numbers that the C library gives them.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "unflex/core/byte_stream.hpp"
#include "unflex/core/text_store.hpp"

namespace unflex::platform {

inline constexpr int kStandardInput = 0;
inline constexpr int kStandardOutput = 1;
inline constexpr int kStandardError = 2;

// A descriptor that closes itself.
class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int fd) : fd_(fd) {}
  // A descriptor that somebody else closes, such as a standard stream.
  [[nodiscard]] static FileDescriptor borrowed(int fd);
  FileDescriptor(FileDescriptor&& other) noexcept;
  FileDescriptor& operator=(FileDescriptor&& other) noexcept;
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  ~FileDescriptor();

  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool valid() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
  bool is_borrowed_ = false;
};

// If opening fails, the descriptor is not valid and errno tells why. Programs that this one starts
// do not inherit these descriptors.
[[nodiscard]] FileDescriptor open_to_read(const std::string& name);
// Opens a device or a pipe that is there already.
[[nodiscard]] FileDescriptor open_to_write(const std::string& name);
// Opens a file so that all writes go to its end. The file is made if there is none.
[[nodiscard]] FileDescriptor open_to_append(const std::string& name);

// Waits until there is something to read, be it the end or an error. False if there is nothing yet.
[[nodiscard]] bool wait_to_read(int descriptor, std::chrono::milliseconds most);
[[nodiscard]] bool wait_to_write(int descriptor, std::chrono::milliseconds most);

// The number of bytes read or written; 0 at the end. A negative number if the call failed; errno
// tells why.
[[nodiscard]] std::ptrdiff_t read_bytes(int descriptor, char* to, std::size_t room);
[[nodiscard]] std::ptrdiff_t write_bytes(int descriptor, std::string_view bytes);
// Reads from a place counted from the file's beginning. read_bytes() still goes on from where it
// was, except on Windows.
[[nodiscard]] std::ptrdiff_t read_bytes_at(int descriptor, char* to, std::size_t room,
                                           std::uint64_t at);

// The descriptor must outlive the source or sink.
[[nodiscard]] std::shared_ptr<ByteSource> descriptor_source(int descriptor);
[[nodiscard]] std::shared_ptr<ByteSink> descriptor_sink(int descriptor);
// The text of a file, to be read only.
[[nodiscard]] std::shared_ptr<TextStore> descriptor_text(int descriptor);

}  // namespace unflex::platform
