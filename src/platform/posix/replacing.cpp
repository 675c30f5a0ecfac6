#include "unflex/platform/replacing.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "../posix_and_wasi/file_calls.hpp"
#include "../temporary_files.hpp"
#include "unflex/platform/folders.hpp"

namespace unflex::platform {
namespace {

// Whether it may be a file that this user made: neither a pipe that somebody gave such a name, nor
// another user's file.
bool is_ours(int descriptor) {
  struct stat status {};
  return ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) && status.st_nlink == 1 &&
         status.st_uid == ::geteuid();
}

mode_t mode_of_new_files() {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return 0666U & ~mask;
}

}  // namespace

tl::expected<LockedFile, int> make_locked_file(const std::string& folder) {
  for (;;) {
    tl::expected<LockedFile, int> made = make_temporary_file(folder, &make_new_file);
    if (!made) {
      return made;
    }
    // Another process may have found and removed the file before it was locked.
    static_cast<void>(::flock(made->file.get(), LOCK_EX));
    if (is_taken(made->name)) {
      return made;
    }
  }
}

Removal remove_unless_locked(const std::string& name) {
  const FileDescriptor file(::open(name.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (file.valid() && !is_ours(file.get())) {
    return Removal::not_ours;
  }
  const bool is_free = file.valid() && ::flock(file.get(), LOCK_EX | LOCK_NB) == 0;
  return is_free && remove_file(name) ? Removal::done : Removal::in_use;
}

tl::expected<FileDescriptor, int> claim_folder(const std::string& folder, Claim claim) {
  FileDescriptor claimed(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!claimed.valid()) {
    return tl::unexpected(errno);
  }
  const int kind = claim == Claim::alone ? LOCK_EX : LOCK_SH;
  int locked = 0;
  do {
    locked = ::flock(claimed.get(), kind | LOCK_NB);
  } while (locked != 0 && errno == EINTR);
  if (locked != 0 && errno == EWOULDBLOCK) {
    return tl::unexpected(EWOULDBLOCK);
  }
  return claimed;
}

int check_writable(const std::string& name) { return outcome(::access(name.c_str(), W_OK)); }

int take_over_permissions(int descriptor, const std::string& replaced) {
  struct stat status {};
  if (::stat(replaced.c_str(), &status) != 0) {
    return outcome(::fchmod(descriptor, mode_of_new_files()));
  }
  const bool same_owner = ::fchown(descriptor, status.st_uid, status.st_gid) == 0;
  if (!same_owner) {
    // At least the group is kept, for folders that a group shares. Otherwise the rights of the
    // group would pass to another group.
    static_cast<void>(::fchown(descriptor, static_cast<uid_t>(-1), status.st_gid));
  }
  // Rights to run as someone must not pass to another owner.
  const mode_t kept = status.st_mode & (same_owner ? 07777U : 0777U);
  return outcome(::fchmod(descriptor, kept));
}

void sync_folder(const std::string& folder) {
  const FileDescriptor opened(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (opened.valid()) {
    ::fsync(opened.get());
  }
}

std::string name_of_descriptor(int descriptor) {
  const tl::expected<FileState, int> state = state_of(descriptor);
  return state && state->kind == FileKind::file ? "/dev/fd/" + std::to_string(descriptor) : "";
}

bool leads_to_descriptor(const std::string& name) {
  namespace fs = std::filesystem;
  std::error_code failed;
  fs::path at = fs::absolute(name, failed);
  // Linux follows at most 40 links.
  for (int links = 0; !failed && links < 40 && fs::is_symlink(at, failed); ++links) {
    const fs::path folder = fs::canonical(at.parent_path(), failed);
    if (folder.string().starts_with("/proc/") && folder.filename() == "fd") {
      return true;
    }
    at = folder / fs::read_symlink(at, failed);
  }
  return false;
}

}  // namespace unflex::platform
