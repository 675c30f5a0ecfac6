#include "lines_ahead.hpp"

#include <algorithm>
#include <string_view>

#include "unflex/core/rewrite_lines.hpp"

namespace unflex::temperature {

Status put_ahead(TextStore& text, const std::string& name, const std::vector<LineAhead>& lines) {
  auto next_to_stand = lines.begin();
  auto next_to_go = lines.begin();
  std::size_t number = 0;
  return rewrite_lines(text, name, [&](std::string_view piece, std::string& out) {
    while (!piece.empty()) {
      const std::size_t newline = piece.find('\n');
      const std::string_view line = piece.substr(0, newline == piece.npos ? newline : newline + 1);
      piece.remove_prefix(line.size());
      ++number;
      for (; next_to_stand != lines.end() && next_to_stand->before_line == number;
           ++next_to_stand) {
        out += next_to_stand->text;
      }
      next_to_go = std::find_if(next_to_go, lines.end(),
                                [&](const LineAhead& ahead) { return ahead.from_line >= number; });
      if (next_to_go == lines.end() || next_to_go->from_line != number) {
        out += line;
      }
    }
  });
}

std::size_t number_behind(const std::vector<LineAhead>& lines, std::size_t number) {
  std::size_t result = number;
  for (const LineAhead& ahead : lines) {
    result += ahead.before_line <= number ? 1 : 0;
    result -= ahead.from_line != 0 && ahead.from_line < number ? 1 : 0;
  }
  return result;
}

}  // namespace unflex::temperature
