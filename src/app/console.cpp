#include "console.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <utility>

#include "files.hpp"
#include "unflex/platform/process.hpp"

namespace unflex::app {
namespace {

// The most lines of a kind that are shown, and the most kinds.
constexpr std::size_t kMaxAlike = 3;
constexpr std::size_t kMaxKinds = 10;

constexpr std::string_view kRed = "\033[1;31m";
constexpr std::string_view kYellow = "\033[1;33m";
constexpr std::string_view kPlain = "\033[0m";

// The kind of a line: the line without its place, numbers and quoted text.
std::string kind_of(std::string_view line) {
  line.remove_prefix(std::min(line.find(": "), line.size()));
  std::string kind;
  bool quoted = false;
  for (const char c : line) {
    const bool quotes = c == '\'';
    quoted = quoted != quotes;
    if (!quoted && !quotes && !(c >= '0' && c <= '9') && c != '.' && c != '-') {
      kind += c;
    }
  }
  return kind;
}

}  // namespace

std::string one_line(std::string_view text) {
  std::string line(text);
  while (!line.empty() && line.back() == '\n') {
    line.pop_back();
  }
  std::transform(line.begin(), line.end(), line.begin(), [](char c) {
    if (c == '\n' || c == '\r' || c == '\t') {
      return ' ';
    }
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
  });
  return line;
}

std::string error_text(const Error& error) {
  const bool placed = !error.place.file.empty() || error.place.line != 0;
  return one_line(placed ? to_string(error) : fmt::format("unflex: {}", error.message));
}

std::string coloured_line(std::string_view line) {
  constexpr std::string_view kWord = "warning:";
  const std::size_t behind = line.find(": warning: ");
  const bool leads = line.starts_with(kWord);
  if (!leads && behind == std::string_view::npos) {
    return std::string(line);
  }
  const std::size_t at = leads ? 0 : behind + 2;
  return fmt::format("{}{}{}{}{}", line.substr(0, at), kYellow, kWord, kPlain,
                     line.substr(at + kWord.size()));
}

std::string coloured_error(const Error& error) {
  const std::string text = error_text(error);
  // The message is found by its length, because a message or a file's name may have colons of its
  // own.
  const std::size_t message = one_line(error.message).size();
  const std::size_t place = text.size() - std::min(text.size(), message);
  return fmt::format("{}{}{}{}", kRed, text.substr(0, place), kPlain, text.substr(place));
}

std::vector<std::string> summarised(const std::vector<std::string>& lines, std::size_t total,
                                    std::string_view what) {
  std::vector<std::string> kinds;  // in the order of their first line
  std::map<std::string, std::vector<const std::string*>> of_kind;
  for (const std::string& line : lines) {
    std::vector<const std::string*>& alike = of_kind[kind_of(line)];
    if (alike.empty()) {
      kinds.push_back(kind_of(line));
    }
    alike.push_back(&line);
  }
  std::vector<std::string> result;
  std::size_t left = total;
  for (std::size_t i = 0; i < std::min(kinds.size(), kMaxKinds); ++i) {
    const std::vector<const std::string*>& alike = of_kind[kinds[i]];
    left -= alike.size();
    // If only one line is too many, the line takes no more room than the remark about it would.
    const std::size_t shown = alike.size() <= kMaxAlike + 1 ? alike.size() : kMaxAlike;
    for (std::size_t n = 0; n < shown; ++n) {
      result.push_back(*alike[n]);
    }
    if (alike.size() > shown) {
      result.push_back(fmt::format("unflex: … and {} more like it", alike.size() - shown));
    }
  }
  if (left > 0) {
    result.push_back(fmt::format("unflex: and {} more {}", left, what));
  }
  return result;
}

Console::Console(int fd) : fd_(fd) {
  const char* const refused = std::getenv("NO_COLOR");
  coloured_ = (refused == nullptr || *refused == '\0') && platform::takes_escape_sequences(fd);
}

void Console::line(std::string_view text) {
  const std::string line = one_line(text);
  say(line, coloured_ ? coloured_line(line) : line);
}

void Console::error(const Error& error) {
  say(error_text(error), coloured_ ? coloured_error(error) : error_text(error));
}

void Console::say(std::string line, const std::string& shown) {
  kept_.push_back(std::move(line));
  if (fd_ >= 0) {
    static_cast<void>(write_all(fd_, shown + "\n"));
  }
}

void Console::lines(const std::vector<std::string>& lines, std::size_t total,
                    std::string_view what) {
  for (const std::string& text : summarised(lines, total, what)) {
    line(text);
  }
}

void Console::note(std::string_view text) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    kept_.push_back(one_line(text.substr(0, end)));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

}  // namespace unflex::app
