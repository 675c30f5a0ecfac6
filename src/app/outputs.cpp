#include "outputs.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "unflex/app/run_config.hpp"

namespace unflex::app {
namespace {

tl::unexpected<Error> refuse(const std::string& name, std::string message) {
  return fail(ErrorKind::usage, {name, 0}, std::move(message));
}

// The directory a file is to be written in, or what speaks against it.
Result<std::filesystem::path> directory_for(const std::string& name,
                                            const std::filesystem::path& target) {
  const std::filesystem::path parent =
      target.has_parent_path() ? target.parent_path() : std::filesystem::path(".");
  struct stat status {};
  if (::stat(parent.c_str(), &status) != 0) {
    return refuse(name, errno == ENOENT ? fmt::format("the directory {} does not exist; create it",
                                                      parent.string())
                                        : fmt::format("cannot write: {}", errno_text(errno)));
  }
  if (!S_ISDIR(status.st_mode)) {
    return refuse(name, fmt::format("cannot write: {} is not a directory", parent.string()));
  }
  return parent;
}

// What the name leads to: the file to replace, or an empty path for a stream.
Result<std::filesystem::path> find_target(const std::string& name) {
  struct stat status {};
  if (name == kStandardStream) {
    return std::filesystem::path();
  }
  if (::stat(name.c_str(), &status) != 0) {
    // A missing directory is told apart later, with a remedy.
    return errno == ENOENT ? Result<std::filesystem::path>(name)
                           : refuse(name, fmt::format("cannot write: {}", errno_text(errno)));
  }
  if (S_ISDIR(status.st_mode)) {
    return refuse(name, "is a directory; name a file in it");
  }
  if (::access(name.c_str(), W_OK) != 0) {
    return refuse(name, fmt::format("cannot write: {}", errno_text(errno)));
  }
  if (!S_ISREG(status.st_mode)) {
    return std::filesystem::path();
  }
  // A symbolic link stays; the file it points to is replaced.
  std::error_code failed;
  std::filesystem::path target = std::filesystem::canonical(name, failed);
  return failed ? refuse(name, fmt::format("cannot write: {}", failed.message()))
                : Result<std::filesystem::path>(std::move(target));
}

mode_t mode_of_new_files() {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return 0666U & ~mask;
}

// Gives the temporary file the owner (where that is allowed) and permissions of what it replaces.
int take_over_permissions(int fd, const std::filesystem::path& target) {
  struct stat status {};
  if (::stat(target.c_str(), &status) != 0) {
    return ::fchmod(fd, mode_of_new_files()) == 0 ? 0 : errno;
  }
  const bool same_owner = ::fchown(fd, status.st_uid, status.st_gid) == 0;
  // Rights to run as someone must not pass to another owner.
  const mode_t kept = status.st_mode & (same_owner ? 07777U : 0777U);
  return ::fchmod(fd, kept) == 0 ? 0 : errno;
}

}  // namespace

Result<Output> Output::open(const std::string& name) {
  Result<std::filesystem::path> target = find_target(name);
  if (!target) {
    return tl::unexpected(target.error());
  }
  const Result<std::filesystem::path> directory =
      target->empty() ? temporary_directory() : directory_for(name, *target);
  if (!directory) {
    return tl::unexpected(directory.error());
  }
  tl::expected<TemporaryFile, int> temporary = TemporaryFile::create(*directory);
  if (!temporary) {
    return refuse(name, fmt::format("cannot write to the directory {}: {}", directory->string(),
                                    errno_text(temporary.error())));
  }
  return Output(name, std::move(*target), std::move(*temporary));
}

Status Output::write(std::string_view text) {
  const int error = write_all(temporary_.fd(), text);
  return error == 0 ? Status{} : Status(cannot_write(error));
}

Status Output::commit() { return target_.empty() ? copy_to_stream() : replace_target(); }

Status Output::replace_target() {
  if (::fsync(temporary_.fd()) != 0) {
    return cannot_write(errno);
  }
  if (const int error = take_over_permissions(temporary_.fd(), target_); error != 0) {
    return cannot_write(error);
  }
  if (::rename(temporary_.path().c_str(), target_.c_str()) != 0) {
    return cannot_write(errno);
  }
  const std::filesystem::path directory = temporary_.path().parent_path();
  temporary_.release();
  // The rename itself must survive a power cut; where directories cannot be synced it is done.
  const FileDescriptor folder(::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.valid()) {
    ::fsync(folder.get());
  }
  return {};
}

Status Output::open_stream() {
  stream_ = FileDescriptor(name_ == kStandardStream ? ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3)
                                                    : ::open(name_.c_str(), O_WRONLY | O_CLOEXEC));
  return stream_.valid() ? Status{} : Status(cannot_write(errno));
}

Result<int> Output::stream_fd() {
  if (!target_.empty()) {
    return -1;
  }
  return open_stream().map([&] { return stream_.get(); });
}

Status Output::copy_to_stream() {
  const FileDescriptor source(::open(temporary_.path().c_str(), O_RDONLY | O_CLOEXEC));
  if (!source.valid()) {
    return cannot_write(errno);
  }
  if (Status opened = open_stream(); !opened) {
    return opened;
  }
  const int error = copy_all(source.get(), stream_.get());
  stream_ = FileDescriptor();  // whoever reads it learns that this was all
  return error == 0 ? Status{} : Status(cannot_write(error));
}

tl::unexpected<Error> Output::cannot_write(int error) const {
  return fail(ErrorKind::internal, {name_ == kStandardStream ? "stdout" : name_, 0},
              fmt::format("cannot write: {}", errno_text(error)));
}

}  // namespace unflex::app
