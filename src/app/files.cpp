#include "files.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <utility>
#include <vector>

#include "signals.hpp"
#include "unflex/app/run_config.hpp"

namespace unflex::app {
namespace {

// The ending keeps temporary files apart from names that people choose, such as .unflex-backup.
constexpr std::string_view kTemporaryName = ".unflex-XXXXXX.tmp";
constexpr std::string_view kTemporaryEnding = ".tmp";
constexpr std::size_t kBlockBytes = std::size_t{1} << 16U;

// How often a wait is interrupted to see whether a signal has come just before it.
constexpr int kPatience_ms = 50;

// Whether to try again what has failed. A signal that does not end the program (a resized window)
// must not end a read either. A stream may be set not to block, for the sake of someone who shares
// it; then we wait for it.
bool try_again(int fd, short events) {
  if (errno == EAGAIN) {
    pollfd what{fd, events, 0};
    ::poll(&what, 1, kPatience_ms);  // an error shows when it is tried again
    errno = EINTR;
  }
  return errno == EINTR && ending_signal() == 0;
}

bool exists(const std::string& name) {
  struct stat status {};
  return ::lstat(name.c_str(), &status) == 0;
}

// Whether it may be a file that unflex made: neither a pipe that somebody gave such a name, nor
// another user's file.
bool is_ours(int fd) {
  struct stat status {};
  return ::fstat(fd, &status) == 0 && S_ISREG(status.st_mode) && status.st_nlink == 1 &&
         status.st_uid == ::geteuid();
}

}  // namespace

FileDescriptor::FileDescriptor(FileDescriptor&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)) {}

FileDescriptor& FileDescriptor::operator=(FileDescriptor&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

FileDescriptor::~FileDescriptor() {
  if (valid()) {
    ::close(fd_);
  }
}

tl::expected<TemporaryFile, int> TemporaryFile::create(const std::filesystem::path& directory) {
  for (;;) {
    std::string name = (directory / kTemporaryName).string();
    FileDescriptor file(
        ::mkostemps(name.data(), static_cast<int>(kTemporaryEnding.size()), O_CLOEXEC));
    if (!file.valid()) {
      return tl::unexpected(errno);
    }
    // The lock tells remove_abandoned() that the file is in use, if the file system has locks.
    // Another process may have found and removed the file before.
    static_cast<void>(::flock(file.get(), LOCK_EX));
    if (exists(name)) {
      return TemporaryFile(std::move(name), std::move(file), ::getpid());
    }
  }
}

bool TemporaryFile::remove_abandoned(const std::filesystem::path& directory) {
  const std::string prefix(kTemporaryName.substr(0, kTemporaryName.find('X')));
  std::error_code failed;
  std::vector<std::filesystem::path> found;
  for (std::filesystem::directory_iterator entry(directory, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    const std::string name = entry->path().filename().string();
    if (name.size() == kTemporaryName.size() && name.starts_with(prefix) &&
        name.ends_with(kTemporaryEnding)) {
      found.push_back(entry->path());
    }
  }
  bool all_gone = true;
  for (const std::filesystem::path& path : found) {
    const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    if (file.valid() && !is_ours(file.get())) {
      continue;
    }
    all_gone = file.valid() && ::flock(file.get(), LOCK_EX | LOCK_NB) == 0 &&
               ::unlink(path.c_str()) == 0 && all_gone;
  }
  return all_gone;
}

TemporaryFile::TemporaryFile(std::filesystem::path path, FileDescriptor fd, pid_t owner)
    : path_(std::move(path)), fd_(std::move(fd)), owner_(owner) {
  remove_if_cut_short(path_.string());
}

TemporaryFile::TemporaryFile(TemporaryFile&& other) noexcept
    : path_(std::exchange(other.path_, {})),
      fd_(std::move(other.fd_)),
      owner_(std::exchange(other.owner_, 0)) {}

TemporaryFile::~TemporaryFile() {
  if (owner_ == ::getpid()) {
    unlink();
  }
}

void TemporaryFile::unlink() {
  if (!path_.empty()) {
    ::unlink(path_.c_str());
    release();
  }
}

void TemporaryFile::release() {
  keep_if_cut_short(path_.string());
  path_.clear();
}

int write_all(int fd, std::string_view data) {
  while (!data.empty()) {
    const ssize_t written = ::write(fd, data.data(), data.size());
    if (written >= 0) {
      data.remove_prefix(static_cast<std::size_t>(written));
    } else if (!try_again(fd, POLLOUT)) {
      return errno;
    }
  }
  return 0;
}

tl::expected<std::string, int> read_some(int fd) {
  std::string block(kBlockBytes, '\0');
  for (;;) {
    const ssize_t got = ::read(fd, block.data(), block.size());
    if (got >= 0) {
      block.resize(static_cast<std::size_t>(got));
      return block;
    }
    if (!try_again(fd, POLLIN)) {
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
    if (ending_signal() != 0) {
      return EINTR;
    }
  }
}

std::string temporary_error_text(int error) {
  return error == EFBIG ? write_error_text(error)
                        : errno_text(error) + "; set TMPDIR to another directory";
}

std::filesystem::path temporary_directory() {
  const char* const chosen = std::getenv("TMPDIR");
  return chosen != nullptr && *chosen != '\0' ? chosen : "/tmp";
}

bool same_file(const std::string& a, const std::string& b) {
  if (a.empty() || b.empty()) {
    return false;
  }
  std::error_code failed;
  if (std::filesystem::equivalent(a, b, failed)) {
    return true;
  }
  // At least one does not exist yet: compare where they would be.
  const auto place = [&failed](const std::string& name) {
    return std::filesystem::weakly_canonical(std::filesystem::absolute(name, failed), failed);
  };
  const std::filesystem::path place_a = place(a);
  return !failed && place_a == place(b) && !failed;
}

std::string name_of_file(const std::string& name, int fd) {
  if (name != kStandardStream) {
    return name;
  }
  struct stat status {};
  const bool is_file = ::fstat(fd, &status) == 0 && S_ISREG(status.st_mode);
  return is_file ? fmt::format("/dev/fd/{}", fd) : "";
}

bool is_descriptor(const std::filesystem::path& name) {
  std::error_code failed;
  std::filesystem::path at = std::filesystem::absolute(name, failed);
  // Linux follows at most 40 links.
  for (int links = 0; !failed && links < 40 && std::filesystem::is_symlink(at, failed); ++links) {
    const std::filesystem::path folder = std::filesystem::canonical(at.parent_path(), failed);
    if (folder.string().starts_with("/proc/") && folder.filename() == "fd") {
      return true;
    }
    at = folder / std::filesystem::read_symlink(at, failed);
  }
  return false;
}

}  // namespace unflex::app
