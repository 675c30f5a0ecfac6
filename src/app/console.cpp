#include "console.hpp"

#include <fmt/format.h>
#include <unistd.h>

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

void print_line(std::string_view text) {
  static_cast<void>(write_all(STDERR_FILENO, one_line(text) + "\n"));
}

void print_error(const Error& error) {
  const bool placed = !error.place.file.empty() || error.place.line != 0;
  print_line(placed ? to_string(error) : fmt::format("unflex: {}", error.message));
}

void print_lines(const std::vector<std::string>& lines, std::size_t total, std::string_view what) {
  const std::size_t listed = std::min(lines.size(), kMaxListed);
  for (std::size_t i = 0; i < listed; ++i) {
    print_line(lines[i]);
  }
  if (total > listed) {
    print_line(fmt::format("unflex: and {} more {}; --report lists them", total - listed, what));
  }
}

}  // namespace unflex::app
