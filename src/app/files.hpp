// Files as the program needs them: descriptors that close themselves, temporary files that remove
// themselves, and writing that does not stop half way.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "unflex/core/errno_text.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

class FileDescriptor {
 public:
  FileDescriptor() = default;
  explicit FileDescriptor(int fd) : fd_(fd) {}
  FileDescriptor(FileDescriptor&& other) noexcept;
  FileDescriptor& operator=(FileDescriptor&& other) noexcept;
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  ~FileDescriptor();

  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] bool valid() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

// A file with a name of its own in `directory`, removed on destruction unless released. Only the
// process that made it removes it: copies in forked workers leave it alone.
class TemporaryFile {
 public:
  [[nodiscard]] static tl::expected<TemporaryFile, int> create(
      const std::filesystem::path& directory);
  TemporaryFile(TemporaryFile&& other) noexcept;
  TemporaryFile& operator=(TemporaryFile&& other) = delete;
  ~TemporaryFile();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] int fd() const { return fd_.get(); }
  // Removes temporary files whose process was killed. False if some are left: they are in use,
  // perhaps by processes that are about to end.
  static bool remove_abandoned(const std::filesystem::path& directory);
  // Removes the name now; the contents live on behind fd().
  void unlink();
  // From here on the file is someone else's, and is not removed.
  void release();

 private:
  TemporaryFile(std::filesystem::path path, FileDescriptor fd, pid_t owner);

  std::filesystem::path path_;
  FileDescriptor fd_;
  pid_t owner_ = 0;
};

// What can be read next, empty at the end, or the errno of what went wrong; EINTR only if a signal
// asked the program to end.
[[nodiscard]] tl::expected<std::string, int> read_some(int fd);

// write_all() and copy_all() return 0 or the errno of what went wrong; EINTR only if a signal asked
// the program to end.
[[nodiscard]] int write_all(int fd, std::string_view data);
[[nodiscard]] int copy_all(int from, int to);

// Why a temporary file cannot be made or written, for messages.
[[nodiscard]] std::string temporary_error_text(int error);

// $TMPDIR or /tmp.
[[nodiscard]] std::filesystem::path temporary_directory();

// Whether both names lead to one file, existing or not. An empty name leads to none.
[[nodiscard]] bool same_file(const std::string& a, const std::string& b);

// The name itself; for "-" a name of the file that descriptor `fd` was redirected to; "" for other
// streams.
[[nodiscard]] std::string name_of_file(const std::string& name, int fd);

// Whether the name leads to a file by an open descriptor, as /dev/stdout does.
[[nodiscard]] bool is_descriptor(const std::filesystem::path& name);

}  // namespace unflex::app
