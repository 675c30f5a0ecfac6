#include "inputs.hpp"

#include <fcntl.h>
#include <fmt/core.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <functional>
#include <memory>
#include <utility>

#include "signals.hpp"
#include "unflex/app/run_config.hpp"

namespace unflex::app {
namespace {

// Gives the text block by block, unpacked if it is packed.
class TextReader {
 public:
  using ReadBlock = std::function<Result<std::string>()>;

  // unpacker: null for plain text. head: what has been read already. read: the next bytes, none at
  // the end.
  TextReader(container::Unpacker* unpacker, std::string head, ReadBlock read)
      : unpacker_(unpacker), head_(std::move(head)), read_(std::move(read)) {
    if (unpacker_ != nullptr) {
      unpacker_->push(head_);
    }
  }

  // The next text; empty at the end.
  Result<std::string> next() {
    if (unpacker_ == nullptr) {
      return head_.empty() ? read_() : std::exchange(head_, {});
    }
    for (;;) {
      Result<std::string> text = unpacker_->pull();
      if (!text || !text->empty() || ended_) {
        return text;
      }
      const Result<std::string> block = read_();
      if (!block) {
        return block;
      }
      ended_ = block->empty();
      if (ended_) {
        unpacker_->finish();
      } else {
        unpacker_->push(*block);
      }
    }
  }

 private:
  container::Unpacker* unpacker_;
  std::string head_;
  ReadBlock read_;
  bool ended_ = false;
};

InputVersion version_of(const struct stat& status) {
  return {status.st_dev, status.st_ino, status.st_size, status.st_mtim.tv_sec,
          status.st_mtim.tv_nsec};
}

}  // namespace

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
  Input input(name, std::move(fd), version_of(status));
  // Even a file on stdin need not stand at its start, so it is copied too.
  input.is_stream_ = is_stdin || !S_ISREG(status.st_mode);
  return input;
}

tl::unexpected<Error> Input::cannot_read(int error) const {
  return fail(ErrorKind::input, {name_, 0}, fmt::format("cannot read: {}", errno_text(error)));
}

Status Input::check_unchanged() const {
  struct stat status {};
  if (is_stream_) {
    return {};
  }
  if (::stat(file_.c_str(), &status) != 0) {
    return fail(ErrorKind::input, {name_, 0}, "vanished while it was worked on; run unflex again");
  }
  return version_of(status) == version_
             ? Status{}
             : Status(fail(ErrorKind::input, {name_, 0},
                           "changed while it was worked on; run unflex again"));
}

Result<std::string> Input::read_block() const {
  return read_some(fd_.get()).map_error([this](int error) { return cannot_read(error).value(); });
}

Status Input::look_at_kind() {
  while (head_.size() < container::kMagicBytes) {
    const Result<std::string> block = read_block();
    if (!block) {
      return tl::unexpected(block.error());
    }
    if (block->empty()) {
      break;
    }
    head_ += *block;
  }
  kind_ = container::detect(head_);
  return {};
}

Result<machine::PrintText> Input::look() {
  if (stream_fd() < 0) {
    return machine::read_print_text(path(), name_);
  }
  const std::unique_ptr<container::Unpacker> unpacker = container::make_unpacker(kind_, name_);
  TextReader reader(unpacker.get(), head_, [this] {
    Result<std::string> block = read_block();
    head_ += block.value_or("");
    return block;
  });
  std::string text;
  while (machine::head_end(text) == std::string::npos) {
    const Result<std::string> piece = reader.next();
    if (!piece) {
      return tl::unexpected(piece.error());
    }
    if (piece->empty()) {
      break;
    }
    text += *piece;
  }
  return machine::PrintText{.name = name_,
                            .head = text.substr(0, machine::head_end(text)),
                            .tail = {},
                            .tail_line = 0,
                            .is_stream = true};
}

Result<std::string> Input::read_all() {
  std::string text;
  for (;;) {
    const Result<std::string> block = read_block();
    if (!block || block->empty()) {
      return block.map([&](const std::string&) { return text; });
    }
    text += *block;
  }
}

Status Input::make_readable() {
  if (Status known = look_at_kind(); !known) {
    return known;
  }
  const bool as_it_comes =
      is_stream_ ? kind_ != container::Kind::bgcode : kind_ == container::Kind::text;
  return as_it_comes ? Status{} : copy_text();
}

Status Input::make_seekable() {
  if (Status known = look_at_kind(); !known) {
    return known;
  }
  return is_stream_ || kind_ != container::Kind::text ? copy_text() : Status{};
}

Status Input::replace_text(const std::function<Status(const Write&)>& make) {
  const std::filesystem::path directory = temporary_directory();
  tl::expected<TemporaryFile, int> copy = TemporaryFile::create(directory);
  if (!copy) {
    return fail(ErrorKind::internal, {directory.string(), 0},
                fmt::format("cannot keep {} here: {}", name_, temporary_error_text(copy.error())));
  }
  // Without a name, nothing is left of the copy, whatever happens.
  copy->unlink();
  const Status made = make([&](std::string_view text) -> Status {
    const int error = ending_signal() != 0 ? EINTR : write_all(copy->fd(), text);
    return error == 0 ? Status{}
                      : Status(fail(ErrorKind::internal, {name_, 0},
                                    fmt::format("cannot be kept in {}: {}", directory.string(),
                                                temporary_error_text(error))));
  });
  if (!made) {
    return made;
  }
  FileDescriptor kept(::fcntl(copy->fd(), F_DUPFD_CLOEXEC, 3));
  if (!kept.valid()) {
    return fail(ErrorKind::internal, {name_, 0}, errno_text(errno));
  }
  fd_ = std::move(kept);
  is_copied_ = true;
  return {};
}

Status Input::copy_text() {
  const std::unique_ptr<container::Unpacker> unpacker = container::make_unpacker(kind_, name_);
  TextReader reader(unpacker.get(), std::exchange(head_, {}), [this] { return read_block(); });
  const Status copied = replace_text([&](const Write& write) -> Status {
    for (;;) {
      const Result<std::string> piece = reader.next();
      if (!piece) {
        return tl::unexpected(piece.error());
      }
      if (piece->empty()) {
        return {};
      }
      if (Status written = write(*piece); !written) {
        return written;
      }
    }
  });
  if (copied && unpacker && unpacker->metadata() != nullptr) {
    metadata_ = *unpacker->metadata();
  }
  return copied;
}

std::filesystem::path Input::path() const {
  return is_stream_ || is_copied_
             ? std::filesystem::path(fmt::format("/proc/self/fd/{}", fd_.get()))
             : file_;
}

}  // namespace unflex::app
