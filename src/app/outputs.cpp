#include "outputs.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <memory>

#include "signals.hpp"
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
  return parent;
}

// What the name leads to: the file to replace, or an empty path for a stream.
Result<std::filesystem::path> find_target(const std::string& name) {
  struct stat status {};
  if (name == kStandardStream) {
    return std::filesystem::path();
  }
  if (::stat(name.c_str(), &status) != 0) {
    if (errno != ENOENT) {
      return refuse(name, fmt::format("cannot write: {}", errno_text(errno)));
    }
    std::error_code failed;
    if (std::filesystem::is_symlink(name, failed)) {
      return refuse(name, "is a link that leads nowhere; make what it leads to, or remove it");
    }
    // A missing directory is told apart later, with a remedy.
    return name;
  }
  if (S_ISDIR(status.st_mode)) {
    return refuse(name, "is a directory; name a file in it");
  }
  if (::access(name.c_str(), W_OK) != 0) {
    return refuse(name, fmt::format("cannot write: {}", write_error_text(errno)));
  }
  if (!S_ISREG(status.st_mode)) {
    return std::filesystem::path();
  }
  if (is_descriptor(name)) {
    return refuse(name, "leads to a file that is open already; give its name, or - for stdout");
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

// Gives the temporary file the owner (if that is allowed) and permissions of the file it replaces.
int take_over_permissions(int fd, const std::filesystem::path& target) {
  struct stat status {};
  if (::stat(target.c_str(), &status) != 0) {
    return ::fchmod(fd, mode_of_new_files()) == 0 ? 0 : errno;
  }
  const bool same_owner = ::fchown(fd, status.st_uid, status.st_gid) == 0;
  if (!same_owner) {
    // At least the group is kept, for folders that a group shares. Otherwise the rights of the
    // group would pass to another group.
    static_cast<void>(::fchown(fd, static_cast<uid_t>(-1), status.st_gid));
  }
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
  // Removes what a killed process may have left there.
  static_cast<void>(TemporaryFile::remove_abandoned(*directory));
  tl::expected<TemporaryFile, int> temporary = TemporaryFile::create(*directory);
  if (!temporary) {
    const int error = temporary.error();
    return target->empty()
               ? fail(ErrorKind::internal, {name, 0},
                      fmt::format("cannot be kept in {}: {}", directory->string(),
                                  temporary_error_text(error)))
               : refuse(name, fmt::format("cannot write to the directory {}: {}",
                                          directory->string(), write_error_text(error)));
  }
  return Output(name, std::move(*target), std::move(*temporary));
}

Status Output::write(std::string_view text) {
  const int error = write_all(temporary_.fd(), text);
  return error == 0 ? Status{} : Status(cannot_write(error));
}

Status Output::seal() {
  if (sealed_) {
    return {};
  }
  return pack().and_then([this] { return is_stream() ? Status{} : settle(); }).map([this] {
    sealed_ = true;
  });
}

Status Output::commit() {
  return seal().and_then([this] { return is_stream() ? copy_to_stream() : replace_target(); });
}

Status Output::pack() {
  if (kind_ == container::Kind::text) {
    return {};
  }
  tl::expected<TemporaryFile, int> packed = TemporaryFile::create(temporary_.path().parent_path());
  if (!packed) {
    return cannot_write(packed.error());
  }
  packed_.emplace(std::move(*packed));
  return pack_into(packed_->fd());
}

Status Output::pack_into(int to) {
  const std::unique_ptr<container::Packer> packer =
      kind_ == container::Kind::gzip ? container::make_gzip_packer()
                                     : container::make_bgcode_packer(name_, origin_);
  const auto write = [&](const std::string& bytes) {
    const int error = write_all(to, bytes);
    return error == 0 ? Status{} : Status(cannot_write(error));
  };
  if (packer->wants_survey()) {
    const Status surveyed =
        for_each_block([&](std::string_view text) { return packer->survey(text); });
    if (!surveyed) {
      return surveyed;
    }
  }
  return for_each_block([&](std::string_view text) { return packer->push(text).and_then(write); })
      .and_then([&] { return packer->finish(); })
      .and_then(write);
}

Status Output::for_each_block(const std::function<Status(std::string_view)>& use) const {
  const FileDescriptor text(::open(temporary_.path().c_str(), O_RDONLY | O_CLOEXEC));
  if (!text.valid()) {
    return cannot_write(errno);
  }
  for (;;) {
    const tl::expected<std::string, int> block = read_some(text.get());
    if (!block) {
      return cannot_write(block.error());
    }
    if (block->empty()) {
      return {};
    }
    if (ending_signal() != 0) {
      return cannot_write(EINTR);
    }
    if (Status used = use(*block); !used) {
      return used;
    }
  }
}

// Puts the result on the disk before it is renamed. Otherwise, after a power cut, the name may be
// there without the contents.
Status Output::settle() const {
  const int fd = result().fd();
  if (const int error = take_over_permissions(fd, target_); error != 0) {
    return cannot_write(error);
  }
  return ::fsync(fd) == 0 ? Status{} : Status(cannot_write(errno));
}

Status Output::replace_target() {
  const TemporaryFile& made = result();
  expect_a_result();
  if (::rename(made.path().c_str(), target_.c_str()) != 0) {
    return cannot_write(errno);
  }
  note_result();
  const std::filesystem::path directory = made.path().parent_path();
  (packed_ ? *packed_ : temporary_).release();
  // The rename itself must survive a power cut. If the directory cannot be synced, it is done all
  // the same.
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
  if (!is_stream() || kind_ == container::Kind::bgcode) {
    return -1;
  }
  return open_stream().map([&] { return stream_.get(); });
}

Status Output::copy_to_stream() {
  const FileDescriptor source(::open(result().path().c_str(), O_RDONLY | O_CLOEXEC));
  if (!source.valid()) {
    return cannot_write(errno);
  }
  if (Status opened = open_stream(); !opened) {
    return opened;
  }
  const int error = copy_all(source.get(), stream_.get());
  stream_ = FileDescriptor();  // closed, so that the reader learns that this was all
  if (error != 0) {
    return cannot_write(error);
  }
  note_result();
  return {};
}

tl::unexpected<Error> Output::cannot_write(int error) const {
  return fail(ErrorKind::internal, {name_ == kStandardStream ? "stdout" : name_, 0},
              fmt::format("cannot write: {}", write_error_text(error)));
}

}  // namespace unflex::app
