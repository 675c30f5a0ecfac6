// The arguments of an extended command, split as a shell would.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace unflex::gcode {

// Splits at blanks; quotes and backslashes protect what they enclose; '#' and ';' outside quotes
// begin a comment (the rules of Python's shlex in POSIX mode, which Klipper applies).
class ShellWords {
 public:
  explicit ShellWords(std::string_view text) : text_(text) {}

  // The next token, quotes taken off; false at the end, at a comment, or when a quote stays open.
  bool next(std::string& token);

  // Where reading stopped: the comment's sign or the end of the text.
  [[nodiscard]] std::size_t position() const { return cursor_; }
  // A quote was opened and never closed, or the text ends in a backslash.
  [[nodiscard]] bool unclosed() const { return unclosed_; }

 private:
  bool read_quoted(std::string& token);

  std::string_view text_;
  std::size_t cursor_ = 0;
  bool unclosed_ = false;
};

}  // namespace unflex::gcode
