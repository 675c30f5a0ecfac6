#include "inputs.hpp"

#include <fmt/core.h>

#include <cerrno>
#include <functional>
#include <memory>
#include <utility>

#include "unflex/app/run_config.hpp"
#include "unflex/core/errno_text.hpp"
#include "unflex/platform/files.hpp"
#include "unflex/platform/replacing.hpp"
#include "unflex/platform/signals.hpp"

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

}  // namespace

Result<Input> Input::open(const std::string& name) {
  const SourcePlace place{name, 0};
  const bool is_stdin = name == kStandardStream;
  FileDescriptor fd =
      is_stdin ? FileDescriptor::borrowed(platform::kStandardInput) : platform::open_to_read(name);
  const tl::expected<platform::FileState, int> state =
      fd.valid() ? platform::state_of(fd.get()) : tl::unexpected(errno);
  if (!state) {
    return fail(ErrorKind::input, place, fmt::format("cannot read: {}", errno_text(state.error())));
  }
  if (state->kind == platform::FileKind::folder) {
    return fail(ErrorKind::input, place, "is a directory, not a G-code file");
  }
  Input input(name, std::move(fd), *state);
  // A file on stdin is copied too, because it need not stand at its start.
  input.is_stream_ = is_stdin || state->kind != platform::FileKind::file;
  return input;
}

Result<Input> Input::of_text(const std::string& name, std::string_view text) {
  Input input(name, {}, {});
  input.is_stream_ = true;
  return input.replace_text([&](const Write& write) { return write(text); }).map([&] {
    return std::move(input);
  });
}

tl::unexpected<Error> Input::cannot_read(int error) const {
  return fail(ErrorKind::input, {name_, 0}, fmt::format("cannot read: {}", errno_text(error)));
}

Status Input::check_unchanged() const {
  if (is_stream_) {
    return {};
  }
  const tl::expected<platform::FileState, int> state = platform::state_of(file_);
  if (!state) {
    return fail(ErrorKind::input, {name_, 0}, "vanished while it was worked on; run unflex again");
  }
  return *state == state_ ? Status{}
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
    return machine::read_print_text(*text(), name_);
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
  return as_it_comes ? close_file() : copy_text();
}

Status Input::make_seekable() {
  if (Status known = look_at_kind(); !known) {
    return known;
  }
  return is_stream_ || kind_ != container::Kind::text ? copy_text() : close_file();
}

// From here on a file is read by its name. Windows could not replace it while it is open.
Status Input::close_file() {
  if (!is_stream_ && !is_copied_) {
    fd_ = FileDescriptor();
  }
  return {};
}

Status Input::replace_text(const std::function<Status(const Write&)>& make) {
  const std::string directory = platform::temporary_directory();
  // A copy without a name cannot be left behind, whatever happens.
  tl::expected<FileDescriptor, int> copy = platform::open_unnamed_file(directory);
  if (!copy) {
    return fail(ErrorKind::internal, {directory, 0},
                fmt::format("cannot keep {} here: {}", name_, temporary_error_text(copy.error())));
  }
  const Status made = make([&](std::string_view text) -> Status {
    const int error = platform::ending_signal() != 0 ? EINTR : write_all(copy->get(), text);
    return error == 0 ? Status{}
                      : Status(fail(ErrorKind::internal, {name_, 0},
                                    fmt::format("cannot be kept in {}: {}", directory,
                                                temporary_error_text(error))));
  });
  if (!made) {
    return made;
  }
  fd_ = std::move(*copy);
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

std::shared_ptr<TextStore> Input::text() const {
  return is_stream_ || is_copied_ ? platform::descriptor_text(fd_.get())
                                  : platform::file_store(file_);
}

}  // namespace unflex::app
