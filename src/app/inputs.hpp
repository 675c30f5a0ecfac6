// Input files, and streams made into files.
#pragma once

#include <filesystem>
#include <string>

#include "files.hpp"
#include "unflex/core/error.hpp"
#include "unflex/machine/print_text.hpp"

namespace unflex::app {

class Input {
 public:
  // Checks that the input can be read. A missing file, a directory and the like are errors of
  // kind input.
  [[nodiscard]] static Result<Input> open(const std::string& name);

  // Copies what cannot be read twice (stdin, pipes) to a temporary file without a name.
  [[nodiscard]] Status make_seekable();

  // What of the print can be seen now. Of a stream its head is taken; it is to be had back from
  // head(), before what stream_fd() still gives.
  [[nodiscard]] Result<machine::PrintText> look();
  [[nodiscard]] const std::string& head() const { return head_; }

  // All of it, of what is small enough to be held.
  [[nodiscard]] Result<std::string> read_all();

  // Of what cannot be read twice, to read it once; otherwise −1.
  [[nodiscard]] int stream_fd() const { return is_stream_ && !is_copied_ ? fd_.get() : -1; }

  // Where to read it, and what the user calls it.
  [[nodiscard]] std::filesystem::path path() const;
  [[nodiscard]] const std::string& name() const { return name_; }
  // Messages call it so from here on.
  void call(std::string name) { name_ = std::move(name); }

 private:
  Input(std::string name, FileDescriptor stream)
      : file_(name), name_(std::move(name)), fd_(std::move(stream)) {}

  std::filesystem::path file_;
  std::string name_;
  FileDescriptor fd_;
  bool is_stream_ = false;
  bool is_copied_ = false;
  std::string head_;  // of a stream, read already
};

}  // namespace unflex::app
