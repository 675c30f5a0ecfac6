// Results that appear whole or not at all.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "files.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

// A temporary file that becomes the result on commit() and vanishes without it. A file is replaced
// by renaming, with the permissions of the one it replaces; a stream (stdout, a device, a pipe)
// gets a copy.
class Output {
 public:
  // Checks that the result can be written, before the work. What cannot is an error of kind usage.
  [[nodiscard]] static Result<Output> open(const std::string& name);

  // Where to write meanwhile.
  [[nodiscard]] const std::filesystem::path& path() const { return temporary_.path(); }
  [[nodiscard]] Status write(std::string_view text);

  // Of a stream, to write to it at once and not commit(); otherwise −1. Errors as of commit().
  [[nodiscard]] Result<int> stream_fd();

  // Errors are of kind internal; the old file is then as it was.
  [[nodiscard]] Status commit();

 private:
  Output(std::string name, std::filesystem::path target, TemporaryFile temporary)
      : name_(std::move(name)), target_(std::move(target)), temporary_(std::move(temporary)) {}

  [[nodiscard]] Status replace_target();
  [[nodiscard]] Status open_stream();
  [[nodiscard]] Status copy_to_stream();
  [[nodiscard]] tl::unexpected<Error> cannot_write(int error) const;

  std::string name_;
  std::filesystem::path target_;  // empty for a stream
  TemporaryFile temporary_;
  FileDescriptor stream_;
};

}  // namespace unflex::app
