// Lines for people: one per message, whatever the message holds.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/platform/descriptors.hpp"

namespace unflex::app {

// Line breaks become spaces and other control characters '?', so that a file's name cannot forge
// a second line or move the cursor.
[[nodiscard]] std::string one_line(std::string_view text);

// "file:line: message", or "unflex: message" for an error without a place.
[[nodiscard]] std::string error_text(const Error& error);

// The line for a terminal, with the word "warning" in colour if there is one.
[[nodiscard]] std::string coloured_line(std::string_view line);

// The error's text for a terminal, with the place it is at in colour, or the program's name.
[[nodiscard]] std::string coloured_error(const Error& error);

// Lines of one kind differ only in place, numbers and quoted text. Gives the first few lines of
// each kind and the number of further ones, then the number of `total` lines that are left. `what`
// names the lines, and may say where all of them are.
[[nodiscard]] std::vector<std::string> summarised(const std::vector<std::string>& lines,
                                                  std::size_t total, std::string_view what);

// The messages of a command while it works. Each message goes to stderr at once. It is also kept,
// for a log and for whoever started the work.
class Console {
 public:
  // fd: where messages go; −1: they are only kept. A message that cannot be written is lost. A
  // terminal gets colours, unless the user does not want any.
  explicit Console(int fd = platform::kStandardError);

  void line(std::string_view text);
  void error(const Error& error);
  // Shows the lines, summarised.
  void lines(const std::vector<std::string>& lines, std::size_t total, std::string_view what);
  void warnings(const std::vector<std::string>& all) {
    lines(all, all.size(), "warnings; --report lists them");
  }

  // Keeps a text that is shown elsewhere, line by line.
  void note(std::string_view text);

  [[nodiscard]] const std::vector<std::string>& kept() const { return kept_; }

 private:
  // Keeps the line and shows it as `shown`, which may have colours.
  void say(std::string line, const std::string& shown);

  int fd_;
  bool coloured_ = false;
  std::vector<std::string> kept_;
};

}  // namespace unflex::app
