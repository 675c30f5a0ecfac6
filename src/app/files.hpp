// Files as the program needs them: temporary files that remove themselves, and writing that does
// not stop half way.
#pragma once

#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "unflex/platform/descriptors.hpp"

namespace unflex::app {

using platform::FileDescriptor;

// A file with a name of its own in `folder`, removed on destruction unless released. Only the
// process that made it removes it: copies in forked workers leave it alone.
class TemporaryFile {
 public:
  [[nodiscard]] static tl::expected<TemporaryFile, int> create(const std::string& folder);
  TemporaryFile(TemporaryFile&& other) noexcept;
  TemporaryFile& operator=(TemporaryFile&& other) = delete;
  ~TemporaryFile();

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] int fd() const { return fd_.get(); }
  // Removes temporary files whose process was killed. False if some are left: they are in use,
  // perhaps by processes that are about to end.
  static bool remove_abandoned(const std::string& folder);
  // Gives the file away. From here on it is not removed.
  void release();

 private:
  TemporaryFile(std::string path, FileDescriptor fd);

  std::string path_;
  FileDescriptor fd_;
  long owner_ = 0;
};

// The next bytes; empty at the end. The error is an errno; EINTR only if a signal asked the program
// to end.
[[nodiscard]] tl::expected<std::string, int> read_some(int fd);

// write_all() and copy_all() return 0 or the errno of what went wrong; EINTR only if a signal asked
// the program to end.
[[nodiscard]] int write_all(int fd, std::string_view data);
[[nodiscard]] int copy_all(int from, int to);

// Why a temporary file cannot be made or written, for messages.
[[nodiscard]] std::string temporary_error_text(int error);

// The name itself. For "-" it is a name of the file that descriptor `fd` was redirected to, or ""
// for other streams.
[[nodiscard]] std::string name_of_file(const std::string& name, int fd);

}  // namespace unflex::app
