// Lines and words of small texts.
#pragma once

#include <string>
#include <string_view>

#include "unflex/core/text.hpp"

namespace unflex::machine {

inline std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return result;
}

// Calls use(line, number) for each line of the text, without its line ending; numbers begin with
// `first`.
template <class Use>
void for_each_line(std::string_view text, std::size_t first, Use use) {
  std::size_t number = first;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    if (line.ends_with('\r')) {
      line.remove_suffix(1);
    }
    use(line, number++);
  }
}

}  // namespace unflex::machine
