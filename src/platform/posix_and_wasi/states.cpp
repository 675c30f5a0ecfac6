#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "unflex/platform/folders.hpp"

namespace unflex::platform {
namespace {

FileState state_in(const struct stat& status) {
#ifdef __APPLE__
  const timespec written = status.st_mtimespec;
#else
  const timespec written = status.st_mtim;
#endif
  const FileKind kind = S_ISREG(status.st_mode)   ? FileKind::file
                        : S_ISDIR(status.st_mode) ? FileKind::folder
                                                  : FileKind::other;
  return {kind,
          static_cast<std::uint64_t>(status.st_dev),
          static_cast<std::uint64_t>(status.st_ino),
          static_cast<std::uint64_t>(status.st_size),
          written.tv_sec,
          written.tv_nsec};
}

}  // namespace

tl::expected<FileState, int> state_of(const std::string& name) {
  struct stat status {};
  if (::stat(name.c_str(), &status) != 0) {
    return tl::unexpected(errno);
  }
  return state_in(status);
}

tl::expected<FileState, int> state_of(int descriptor) {
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) {
    return tl::unexpected(errno);
  }
  return state_in(status);
}

bool is_link(const std::string& name) {
  struct stat status {};
  return ::lstat(name.c_str(), &status) == 0 && S_ISLNK(status.st_mode);
}

bool is_taken(const std::string& name) {
  struct stat status {};
  return ::lstat(name.c_str(), &status) == 0;
}

void remove_empty_folder(const std::string& folder) { ::rmdir(folder.c_str()); }

}  // namespace unflex::platform
