#include "files.hpp"

#include <fmt/core.h>

#include <cerrno>
#include <chrono>
#include <utility>

#include "unflex/app/run_config.hpp"
#include "unflex/core/errno_text.hpp"
#include "unflex/platform/folders.hpp"
#include "unflex/platform/names.hpp"
#include "unflex/platform/process.hpp"
#include "unflex/platform/replacing.hpp"
#include "unflex/platform/signals.hpp"

namespace unflex::app {
namespace {

constexpr std::size_t kBlockBytes = std::size_t{1} << 16U;

// The longest single wait. After it the program looks for a signal that came just before the wait.
constexpr std::chrono::milliseconds kPatience{50};

// Whether to repeat a call that has failed. A signal that does not end the program (a resized
// window) must not end a read. A stream may be set not to block, because another process that
// shares it wants that. Then `wait` waits for the stream.
bool try_again(int fd, bool (*wait)(int, std::chrono::milliseconds)) {
  if (errno == EAGAIN) {
    static_cast<void>(wait(fd, kPatience));  // the repeated call shows any error
    errno = EINTR;
  }
  return errno == EINTR && platform::ending_signal() == 0;
}

}  // namespace

tl::expected<TemporaryFile, int> TemporaryFile::create(const std::string& folder) {
  return platform::make_locked_file(folder).map([](platform::LockedFile made) {
    return TemporaryFile(std::move(made.name), std::move(made.file));
  });
}

bool TemporaryFile::remove_abandoned(const std::string& folder) {
  bool all_gone = true;
  for (const platform::FolderEntry& entry : platform::entries_of(folder.empty() ? "." : folder)
                                                .value_or(std::vector<platform::FolderEntry>{})) {
    if (platform::is_temporary_name(entry.name)) {
      all_gone = platform::remove_unless_locked(platform::joined(folder, entry.name)) !=
                     platform::Removal::in_use &&
                 all_gone;
    }
  }
  return all_gone;
}

TemporaryFile::TemporaryFile(std::string path, FileDescriptor fd)
    : path_(std::move(path)), fd_(std::move(fd)), owner_(platform::process_number()) {
  platform::remove_if_cut_short(path_);
}

TemporaryFile::TemporaryFile(TemporaryFile&& other) noexcept
    : path_(std::exchange(other.path_, {})),
      fd_(std::move(other.fd_)),
      owner_(std::exchange(other.owner_, 0)) {}

TemporaryFile::~TemporaryFile() {
  if (!path_.empty() && owner_ == platform::process_number()) {
    platform::remove_file(path_);
    release();
  }
}

void TemporaryFile::release() {
  platform::keep_if_cut_short(path_);
  path_.clear();
}

int write_all(int fd, std::string_view data) {
  while (!data.empty()) {
    const std::ptrdiff_t written = platform::write_bytes(fd, data);
    if (written >= 0) {
      data.remove_prefix(static_cast<std::size_t>(written));
    } else if (!try_again(fd, platform::wait_to_write)) {
      return errno;
    }
  }
  return 0;
}

tl::expected<std::string, int> read_some(int fd) {
  std::string block(kBlockBytes, '\0');
  for (;;) {
    const std::ptrdiff_t got = platform::read_bytes(fd, block.data(), block.size());
    if (got >= 0) {
      block.resize(static_cast<std::size_t>(got));
      return block;
    }
    if (!try_again(fd, platform::wait_to_read)) {
      return tl::unexpected(errno);
    }
  }
}

int copy_all(int from, int to) {
  for (;;) {
    const tl::expected<std::string, int> block = read_some(from);
    if (!block) {
      return block.error();
    }
    if (block->empty()) {
      return 0;
    }
    if (const int error = write_all(to, *block); error != 0) {
      return error;
    }
    if (platform::ending_signal() != 0) {
      return EINTR;
    }
  }
}

std::string temporary_error_text(int error) {
  return error == EFBIG ? write_error_text(error)
                        : fmt::format("{}; set {} to another directory", errno_text(error),
                                      platform::kTemporaryDirectoryVariable);
}

std::string name_of_file(const std::string& name, int fd) {
  return name == kStandardStream ? platform::name_of_descriptor(fd) : name;
}

}  // namespace unflex::app
