// Results that appear whole or not at all.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "files.hpp"
#include "unflex/container/container.hpp"
#include "unflex/core/error.hpp"

namespace unflex::app {

// A temporary file that becomes the result on commit() and vanishes without it. A file is replaced
// by renaming, with the permissions of the one it replaces; a stream (stdout, a device, a pipe)
// gets a copy.
class Output {
 public:
  // Checks before the work that the result can be written. If not, that is an error of kind usage.
  [[nodiscard]] static Result<Output> open(const std::string& name);

  // Makes commit() pack the text that was written. origin: metadata of the binary file that the
  // text was made from, or null; must outlive this object.
  void pack_as(container::Kind kind, const container::Metadata* origin) {
    kind_ = kind;
    origin_ = origin;
  }
  [[nodiscard]] container::Kind kind() const { return kind_; }
  [[nodiscard]] bool is_stream() const { return target_.empty(); }

  // Where to write before commit(); always text.
  [[nodiscard]] const std::string& path() const { return temporary_.path(); }
  [[nodiscard]] Status write(std::string_view text);

  // The descriptor of a stream. The caller writes to it at once, packed as asked, and does not
  // commit(). −1 for a file. −1 also for binary G-code, whose beginning is known last. Errors are
  // those of commit().
  [[nodiscard]] Result<int> stream_fd();

  // Does the part of commit() that takes room on the disk, since that part fails most often.
  // Nothing may be written after it.
  [[nodiscard]] Status seal();

  // Puts the result in place. Errors are of kind internal; the old file is then as it was.
  [[nodiscard]] Status commit();

 private:
  Output(std::string name, std::string target, TemporaryFile temporary)
      : name_(std::move(name)), target_(std::move(target)), temporary_(std::move(temporary)) {}

  [[nodiscard]] Status pack();
  [[nodiscard]] Status pack_into(int to);
  // Calls `use` for each block of the text.
  [[nodiscard]] Status for_each_block(const std::function<Status(std::string_view)>& use) const;
  [[nodiscard]] const TemporaryFile& result() const { return packed_ ? *packed_ : temporary_; }
  [[nodiscard]] Status settle() const;
  [[nodiscard]] Status replace_target();
  [[nodiscard]] Status open_stream();
  [[nodiscard]] Status copy_to_stream();
  [[nodiscard]] tl::unexpected<Error> cannot_write(int error) const;

  std::string name_;
  std::string target_;  // empty for a stream
  TemporaryFile temporary_;
  std::optional<TemporaryFile> packed_;
  container::Kind kind_ = container::Kind::text;
  const container::Metadata* origin_ = nullptr;
  FileDescriptor stream_;
  bool sealed_ = false;
};

}  // namespace unflex::app
