#include "retime.hpp"

#include <string_view>

#include "rewrite_lines.hpp"
#include "unflex/gcode/time_note.hpp"

namespace unflex::pipeline {
std::string scaled_lines(std::string_view text, double factor) {
  std::string out;
  while (!text.empty()) {
    const std::size_t newline = text.find('\n');
    const std::size_t length = newline == std::string_view::npos ? text.size() : newline;
    std::string_view line = text.substr(0, length);
    const bool carriage_return = line.ends_with('\r');
    line.remove_suffix(carriage_return ? 1 : 0);
    out += gcode::with_times_scaled(line, factor);
    out += text.substr(line.size(),
                       length + (newline == std::string_view::npos ? 0 : 1) - line.size());
    text.remove_prefix(std::min(length + 1, text.size()));
  }
  return out;
}

Status retime(const std::string& path, const std::string& name, double factor) {
  return rewrite_lines(path, name, [&](std::string_view text, std::string& out) {
    out += scaled_lines(text, factor);
  });
}

}  // namespace unflex::pipeline
