#include <fmt/core.h>

#include <cctype>
#include <string>

#include "command_reader.hpp"
#include "rrf_travel.hpp"
#include "unflex/core/number.hpp"
#include "unflex/core/text.hpp"

namespace unflex::machine {
namespace {

constexpr std::string_view kInNumbers = "0123456789.+-";

// The length of the value that the text begins with: a number, an expression in braces, or a text
// in quotes.
std::size_t value_length(std::string_view text) {
  int depth = 0;
  bool in_quotes = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    in_quotes = in_quotes != (c == '"');
    depth += in_quotes ? 0 : (c == '{') - (c == '}');
    const bool goes_on = in_quotes || depth > 0 || c == '"' || c == '}' ||
                         kInNumbers.find(c) != std::string_view::npos;
    if (!goes_on) {
      return at;
    }
  }
  return text.size();
}

}  // namespace

std::map<char, std::vector<std::string_view>> values_of(std::string_view arguments) {
  std::map<char, std::vector<std::string_view>> values;
  while (!arguments.empty()) {
    const auto letter = static_cast<char>(std::toupper(static_cast<unsigned char>(arguments[0])));
    arguments = trimmed(arguments.substr(1));
    values.erase(letter);
    for (bool is_value = letter >= 'A' && letter <= 'Z'; is_value;) {
      const std::size_t length = value_length(arguments);
      values[letter].push_back(arguments.substr(0, length));
      arguments.remove_prefix(length);
      is_value = arguments.starts_with(':');
      arguments.remove_prefix(is_value ? 1 : 0);
    }
  }
  return values;
}

void RrfTravel::read(std::string_view arguments, const SourcePlace& place, Reading& reading) {
  const std::map<char, std::vector<std::string_view>> values = values_of(arguments);
  const auto s = values.find('S');
  const bool is_min = s != values.end() && parse_number(s->second.front()) == 1.0;
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    const auto given = values.find(letter_of(axis));
    if (given == values.end()) {
      continue;
    }
    std::string_view why;
    const auto take = [&](End& end, std::string_view text) {
      if (const std::optional<double> mm = parse_number(text)) {
        end = {mm, place};
      } else {
        end.is_outdated = true;
        why = text.starts_with('{') ? "an expression, which unflex does not evaluate" : "no number";
      }
    };
    const std::vector<std::string_view>& list = given->second;
    auto& [min, max] = axes_[axis];
    take(is_min || list.size() > 1 ? min : max, list.front());
    if (list.size() > 1) {
      take(max, list[1]);
    }
    if (!why.empty()) {
      const std::string key = fmt::format("printer.travel_{}_mm", kAxes[axis]);
      reading.note(
          place, fmt::format("{}: {} is not taken; give {} with --set", why, letter_of(axis), key),
          {key});
    }
  }
}

// If one end is outdated, the key gets that end's place. It is before the place of the note on that
// end, so the note is still told (load.cpp, is_known).
void RrfTravel::add_to(Reading& reading) const {
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    const auto& [min, max] = axes_[axis];
    if (!max.mm || (min.is_outdated && !min.mm)) {
      continue;
    }
    const bool of_min = min.is_outdated || (!max.is_outdated && min.place.line > max.place.line);
    reading.add(fmt::format("printer.travel_{}_mm", kAxes[axis]),
                Range{min.mm.value_or(0.0), *max.mm}, of_min ? min.place : max.place);
  }
}

}  // namespace unflex::machine
