// Input files, and streams made into files.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "files.hpp"
#include "unflex/container/container.hpp"
#include "unflex/core/error.hpp"
#include "unflex/core/text_store.hpp"
#include "unflex/machine/print_text.hpp"
#include "unflex/platform/folders.hpp"

namespace unflex::app {

class Input {
 public:
  // Checks that the input can be read. A missing file, a directory and the like are errors of
  // kind input.
  [[nodiscard]] static Result<Input> open(const std::string& name);

  // A text that is in no file, under the name that messages call it.
  [[nodiscard]] static Result<Input> of_text(const std::string& name, std::string_view text);

  // Makes the input a file that can be read twice. Copies stdin, pipes, and the text of packed
  // inputs to a temporary file without a name.
  [[nodiscard]] Status make_seekable();

  // Copies like make_seekable(), but leaves text and gzip in a stream, since they can be read once
  // as they come.
  [[nodiscard]] Status make_readable();

  // Replaces the input's text. `make` gets a function and writes the new text with it, to a
  // temporary file without a name.
  using Write = std::function<Status(std::string_view)>;
  [[nodiscard]] Status replace_text(const std::function<Status(const Write&)>& make);

  // The packing of the input, and the metadata of a binary file. Both are known once the input was
  // made readable or seekable.
  [[nodiscard]] container::Kind kind() const { return kind_; }
  [[nodiscard]] const std::optional<container::Metadata>& metadata() const { return metadata_; }

  // The text of the print that can be seen now. From a stream this takes the first bytes. head()
  // gives these bytes, still packed if they were packed. stream_fd() gives the bytes after them.
  [[nodiscard]] Result<machine::PrintText> look();
  [[nodiscard]] const std::string& head() const { return head_; }

  // Checks that the file is still the one that was opened. If it has changed, the text may be of
  // two files and is no base for a result: an error of kind input.
  [[nodiscard]] Status check_unchanged() const;

  // Reads all of an input that is small enough to be held.
  [[nodiscard]] Result<std::string> read_all();

  // The descriptor of an input that cannot be read twice, to read it once; −1 for other inputs.
  [[nodiscard]] int stream_fd() const { return is_stream_ && !is_copied_ ? fd_.get() : -1; }

  // Where to read the input, as long as this object lives, and the user's name for it.
  [[nodiscard]] std::shared_ptr<TextStore> text() const;
  [[nodiscard]] const std::string& name() const { return name_; }
  // Sets the name of the input in messages from here on.
  void call(std::string name) { name_ = std::move(name); }

 private:
  Input(std::string name, FileDescriptor stream, const platform::FileState& state)
      : file_(name), name_(std::move(name)), fd_(std::move(stream)), state_(state) {}

  // Reads as far as it takes to know kind_.
  [[nodiscard]] Status look_at_kind();
  // The next bytes of the input; empty at the end.
  [[nodiscard]] Result<std::string> read_block() const;
  Status close_file();
  // Copies all of it as text to a temporary file, which takes the input's place.
  [[nodiscard]] Status copy_text();
  [[nodiscard]] tl::unexpected<Error> cannot_read(int error) const;

  std::string file_;
  std::string name_;
  FileDescriptor fd_;
  platform::FileState state_;  // when it was opened
  bool is_stream_ = false;
  bool is_copied_ = false;  // its text is in a temporary file
  container::Kind kind_ = container::Kind::text;
  std::optional<container::Metadata> metadata_;
  std::string head_;  // first bytes, if they were read already
};

}  // namespace unflex::app
