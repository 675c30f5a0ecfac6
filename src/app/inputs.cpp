#include "inputs.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "unflex/app/run_config.hpp"

namespace unflex::app {

Result<Input> Input::open(const std::string& name) {
  const SourcePlace place{name, 0};
  const bool is_stdin = name == kStandardStream;
  FileDescriptor fd(is_stdin ? ::fcntl(STDIN_FILENO, F_DUPFD_CLOEXEC, 3)
                             : ::open(name.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat status {};
  if (!fd.valid() || ::fstat(fd.get(), &status) != 0) {
    return fail(ErrorKind::input, place, fmt::format("cannot read: {}", errno_text(errno)));
  }
  if (S_ISDIR(status.st_mode)) {
    return fail(ErrorKind::input, place, "is a directory, not a G-code file");
  }
  Input input(name, std::move(fd));
  // Even a file on stdin may stand anywhere but at its start, so it is copied too.
  input.is_stream_ = is_stdin || !S_ISREG(status.st_mode);
  return input;
}

Result<machine::PrintText> Input::look() {
  if (stream_fd() < 0) {
    return machine::read_print_text(path(), name_);
  }
  while (machine::head_end(head_) == std::string::npos && head_.size() < machine::kMaxHeadBytes) {
    const tl::expected<std::string, int> block = read_some(fd_.get());
    if (!block) {
      return fail(ErrorKind::input, {name_, 0},
                  fmt::format("cannot read: {}", errno_text(block.error())));
    }
    if (block->empty()) {
      break;
    }
    head_ += *block;
  }
  return machine::PrintText{.name = name_,
                            .head = head_.substr(0, machine::head_end(head_)),
                            .tail = {},
                            .tail_line = 0,
                            .is_stream = true};
}

Result<std::string> Input::read_all() {
  std::string text;
  for (;;) {
    const tl::expected<std::string, int> block = read_some(fd_.get());
    if (!block) {
      return fail(ErrorKind::input, {name_, 0},
                  fmt::format("cannot read: {}", errno_text(block.error())));
    }
    if (block->empty()) {
      return text;
    }
    text += *block;
  }
}

Status Input::make_seekable() {
  if (!is_stream_) {
    return {};
  }
  const std::filesystem::path directory = temporary_directory();
  tl::expected<TemporaryFile, int> copy = TemporaryFile::create(directory);
  if (!copy) {
    return fail(ErrorKind::internal, {directory.string(), 0},
                fmt::format("cannot keep {} here: {}; set TMPDIR to another directory", name_,
                            errno_text(copy.error())));
  }
  if (const int error = copy_all(fd_.get(), copy->fd()); error != 0) {
    return fail(error == EISDIR || error == EIO ? ErrorKind::input : ErrorKind::internal,
                {name_, 0},
                fmt::format("cannot copy to {}: {}", directory.string(), errno_text(error)));
  }
  FileDescriptor kept(::fcntl(copy->fd(), F_DUPFD_CLOEXEC, 3));
  if (!kept.valid()) {
    return fail(ErrorKind::internal, {name_, 0}, errno_text(errno));
  }
  fd_ = std::move(kept);
  is_copied_ = true;
  return {};
}

std::filesystem::path Input::path() const {
  return is_stream_ ? std::filesystem::path(fmt::format("/proc/self/fd/{}", fd_.get())) : file_;
}

}  // namespace unflex::app
