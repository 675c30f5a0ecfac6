#include "outputs.hpp"

#include <fmt/core.h>

#include <cerrno>
#include <memory>

#include "unflex/app/run_config.hpp"
#include "unflex/core/errno_text.hpp"
#include "unflex/platform/files.hpp"
#include "unflex/platform/folders.hpp"
#include "unflex/platform/names.hpp"
#include "unflex/platform/replacing.hpp"
#include "unflex/platform/signals.hpp"

namespace unflex::app {
namespace {

tl::unexpected<Error> refuse(const std::string& name, std::string message) {
  return fail(ErrorKind::usage, {name, 0}, std::move(message));
}

// The directory that a file is to be written in, or the error that forbids it.
Result<std::string> directory_for(const std::string& name, const std::string& target) {
  const std::string parent = platform::folder_of(target);
  std::string directory = parent.empty() ? "." : parent;
  if (const auto state = platform::state_of(directory); !state) {
    return refuse(name, state.error() == ENOENT
                            ? fmt::format("the directory {} does not exist; create it", directory)
                            : fmt::format("cannot write: {}", errno_text(state.error())));
  }
  return directory;
}

// The target of the name: the file to replace, or an empty name for a stream.
Result<std::string> find_target(const std::string& name) {
  if (name == kStandardStream) {
    return std::string();
  }
  const tl::expected<platform::FileState, int> state = platform::state_of(name);
  if (!state) {
    if (state.error() != ENOENT) {
      return refuse(name, fmt::format("cannot write: {}", errno_text(state.error())));
    }
    if (platform::is_link(name)) {
      return refuse(name, "is a link that leads nowhere; make what it leads to, or remove it");
    }
    // A missing directory is told apart later, with a remedy.
    return name;
  }
  if (state->kind == platform::FileKind::folder) {
    return refuse(name, "is a directory; name a file in it");
  }
  if (const int error = platform::check_writable(name); error != 0) {
    return refuse(name, fmt::format("cannot write: {}", write_error_text(error)));
  }
  if (state->kind != platform::FileKind::file) {
    return std::string();
  }
  if (platform::leads_to_descriptor(name)) {
    return refuse(name, "leads to a file that is open already; give its name, or - for stdout");
  }
  // A symbolic link stays; the file it points to is replaced.
  return platform::canonical_name(name);
}

}  // namespace

Result<Output> Output::open(const std::string& name) {
  Result<std::string> target = find_target(name);
  if (!target) {
    return tl::unexpected(target.error());
  }
  const Result<std::string> directory =
      target->empty() ? platform::temporary_directory() : directory_for(name, *target);
  if (!directory) {
    return tl::unexpected(directory.error());
  }
  // Removes what a killed process may have left there.
  static_cast<void>(TemporaryFile::remove_abandoned(*directory));
  tl::expected<TemporaryFile, int> temporary = TemporaryFile::create(*directory);
  if (!temporary) {
    const int error = temporary.error();
    return target->empty() ? fail(ErrorKind::internal, {name, 0},
                                  fmt::format("cannot be kept in {}: {}", *directory,
                                              temporary_error_text(error)))
                           : refuse(name, fmt::format("cannot write to the directory {}: {}",
                                                      *directory, write_error_text(error)));
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
  tl::expected<TemporaryFile, int> packed =
      TemporaryFile::create(platform::folder_of(temporary_.path()));
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
  const FileDescriptor text = platform::open_to_read(temporary_.path());
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
    if (platform::ending_signal() != 0) {
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
  int error = platform::take_over_permissions(fd, target_);
  if (error == 0) {
    error = platform::sync_file(fd);
  }
  return error == 0 ? Status{} : Status(cannot_write(error));
}

Status Output::replace_target() {
  const TemporaryFile& made = result();
  platform::expect_a_result();
  if (const int error = platform::replace_file(made.path(), target_); error != 0) {
    return cannot_write(error);
  }
  platform::note_result();
  const std::string directory = platform::folder_of(made.path());
  (packed_ ? *packed_ : temporary_).release();
  // The new name itself must survive a power cut. If the directory cannot be put on the disk, the
  // result counts as written all the same.
  platform::sync_folder(directory);
  return {};
}

Status Output::open_stream() {
  stream_ = name_ == kStandardStream ? FileDescriptor::borrowed(platform::kStandardOutput)
                                     : platform::open_to_write(name_);
  return stream_.valid() ? Status{} : Status(cannot_write(errno));
}

Result<int> Output::stream_fd() {
  if (!is_stream() || kind_ == container::Kind::bgcode) {
    return -1;
  }
  return open_stream().map([&] { return stream_.get(); });
}

Status Output::copy_to_stream() {
  const FileDescriptor source = platform::open_to_read(result().path());
  if (!source.valid()) {
    return cannot_write(errno);
  }
  if (Status opened = open_stream(); !opened) {
    return opened;
  }
  const int error = copy_all(source.get(), stream_.get());
  stream_ = FileDescriptor();  // closed, so that the reader sees the end
  if (error != 0) {
    return cannot_write(error);
  }
  platform::note_result();
  return {};
}

tl::unexpected<Error> Output::cannot_write(int error) const {
  return fail(ErrorKind::internal, {name_ == kStandardStream ? "stdout" : name_, 0},
              fmt::format("cannot write: {}", write_error_text(error)));
}

}  // namespace unflex::app
