// Bytes to lines, losing none of them.
#pragma once

#include <cstddef>
#include <istream>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"

namespace unflex::gcode {

// One line of the input, byte for byte.
struct Line {
  std::string text;             // with its line ending ("\n", "\r\n"); the last line may have none
  std::size_t number = 0;       // 1-based
  bool may_hold_return = true;  // false: there is no carriage return in it

  // The text without its line ending.
  [[nodiscard]] std::string_view content() const;
  // Whether text follows a '\r' within the line. Other programs would end the line there.
  [[nodiscard]] bool has_bare_return() const;
};

// Pulls lines from a stream in blocks. Concatenating the texts of all lines gives the input back.
class LineReader {
 public:
  // The stream must outlive the reader and be opened in binary mode. name: for messages.
  LineReader(std::istream& stream, std::string name);

  // The next line, as soon as the stream has it; false at the end. An error when the stream fails,
  // when a NUL byte shows that this is no text, or when a line is longer than 1 MiB.
  [[nodiscard]] Result<bool> next(Line& line);

  [[nodiscard]] const std::string& name() const { return name_; }
  // Bytes handed out so far.
  [[nodiscard]] std::size_t bytes_read() const { return bytes_read_; }

 private:
  void fill_block();

  std::istream* stream_;
  std::string name_;
  std::vector<char> block_;
  std::size_t cursor_ = 0;
  std::size_t filled_ = 0;
  bool block_has_return_ = false;
  bool block_has_nul_ = false;
  std::size_t line_number_ = 0;
  std::size_t bytes_read_ = 0;
};

}  // namespace unflex::gcode
