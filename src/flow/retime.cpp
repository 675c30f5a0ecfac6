#include "retime.hpp"

#include <algorithm>
#include <string_view>

#include "unflex/core/rewrite_lines.hpp"

namespace unflex::flow {
namespace {

// Appends the text, whose lines have these factors, one after the other.
template <class FactorsOfLine>
void append_scaled_lines(std::string_view text, FactorsOfLine factors_of_line, std::string& out) {
  while (!text.empty()) {
    const std::size_t newline = text.find('\n');
    const std::size_t length = newline == std::string_view::npos ? text.size() : newline;
    std::string_view line = text.substr(0, length);
    const bool carriage_return = line.ends_with('\r');
    line.remove_suffix(carriage_return ? 1 : 0);
    out += gcode::with_times_scaled(line, factors_of_line());
    out += text.substr(line.size(),
                       length + (newline == std::string_view::npos ? 0 : 1) - line.size());
    text.remove_prefix(std::min(length + 1, text.size()));
  }
}

}  // namespace

std::string scaled_lines(std::string_view text, double factor) {
  std::string out;
  append_scaled_lines(
      text, [&] { return gcode::TimeFactors::even(factor); }, out);
  return out;
}

gcode::TimeFactors factors_at(const verify::TimeNote& note, const verify::TimeNote& end) {
  const double whole = end.emitted_s / end.reference_s;
  const double left_s = end.reference_s - note.reference_s;
  const auto ratio = [&](double emitted_s, double reference_s) {
    return reference_s > kShortest_s && emitted_s > 0.0 ? emitted_s / reference_s : whole;
  };
  return {whole, ratio(note.emitted_s, note.reference_s),
          ratio(end.emitted_s - note.emitted_s, left_s)};
}

Status retime(TextStore& text, const std::string& name, const std::vector<verify::TimeNote>& notes,
              const verify::TimeNote& end) {
  std::size_t number = 0;
  auto next = notes.begin();
  const auto factors_of_line = [&] {
    next = std::find_if(next, notes.end(),
                        [&](const verify::TimeNote& note) { return note.line > number; });
    ++number;
    return next != notes.end() && next->line == number
               ? factors_at(*next, end)
               : gcode::TimeFactors::even(end.emitted_s / end.reference_s);
  };
  return rewrite_lines(text, name, [&](std::string_view piece, std::string& out) {
    append_scaled_lines(piece, factors_of_line, out);
  });
}

}  // namespace unflex::flow
