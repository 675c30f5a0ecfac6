#include "console.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "files.hpp"

namespace unflex::app {
namespace {

constexpr std::size_t kMaxListed = 10;

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

void Console::line(std::string_view text) {
  kept_.push_back(one_line(text));
  if (fd_ >= 0) {
    static_cast<void>(write_all(fd_, kept_.back() + "\n"));
  }
}

void Console::lines(const std::vector<std::string>& lines, std::size_t total,
                    std::string_view what) {
  const std::size_t listed = std::min(lines.size(), kMaxListed);
  for (std::size_t i = 0; i < listed; ++i) {
    line(lines[i]);
  }
  if (total > listed) {
    line(fmt::format("unflex: and {} more {}; --report lists them", total - listed, what));
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
