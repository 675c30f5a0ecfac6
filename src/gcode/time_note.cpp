#include "unflex/gcode/time_note.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

namespace unflex::gcode {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

// Writes the duration that begins at text[i], scaled, and moves i behind it. False if none begins
// there.
using Duration = bool (*)(std::string_view text, std::size_t& i, double factor, std::string& out);

// A number like 2789 or 376.225026. It keeps its count of decimals.
bool number(std::string_view text, std::size_t& i, double factor, std::string& out) {
  std::size_t end = i;
  std::size_t decimals = 0;
  while (end < text.size() && is_digit(text[end])) {
    ++end;
  }
  if (end == i) {
    return false;
  }
  if (end + 1 < text.size() && text[end] == '.' && is_digit(text[end + 1])) {
    const std::size_t point = end++;
    while (end < text.size() && is_digit(text[end])) {
      ++end;
    }
    decimals = end - point - 1;
  }
  double value = 0.0;
  if (std::from_chars(text.data() + i, text.data() + end, value).ec != std::errc{}) {
    return false;
  }
  out += fmt::format("{:.{}f}", value * factor, decimals);
  i = end;
  return true;
}

// A duration like 1d 2h 3m 4s, which may begin with any unit.
bool units(std::string_view text, std::size_t& i, double factor, std::string& out) {
  struct Unit {
    char name;
    std::int64_t seconds;
  };
  constexpr std::array<Unit, 4> kUnits = {{{'d', 86400}, {'h', 3600}, {'m', 60}, {'s', 1}}};
  std::int64_t total_s = 0;
  std::size_t end = i;
  std::size_t unit = 0;
  bool any = false;
  for (;;) {
    std::int64_t value = 0;
    const std::size_t begin = any && end < text.size() && text[end] == ' ' ? end + 1 : end;
    const auto [after, error] =
        std::from_chars(text.data() + begin, text.data() + text.size(), value);
    const auto at = static_cast<std::size_t>(after - text.data());
    if (error != std::errc{} || value < 0 || value > 1'000'000 || at >= text.size()) {
      break;
    }
    const auto found =
        std::find_if(kUnits.begin() + static_cast<std::ptrdiff_t>(unit), kUnits.end(),
                     [&](const Unit& u) { return u.name == text[at]; });
    if (found == kUnits.end()) {
      break;
    }
    total_s += value * found->seconds;
    unit = static_cast<std::size_t>(found - kUnits.begin()) + 1;
    end = at + 1;
    any = true;
  }
  if (!any || (end < text.size() && (is_digit(text[end]) || lower(text[end]) != text[end] ||
                                     (text[end] >= 'a' && text[end] <= 'z')))) {
    return false;
  }
  const bool to_seconds = text[end - 1] == 's';
  std::int64_t left = std::llround(static_cast<double>(total_s) * factor);
  if (!to_seconds) {
    const std::int64_t smallest = kUnits[unit - 1].seconds;
    left = (left + smallest / 2) / smallest * smallest;
  }
  std::string written;
  for (std::size_t k = 0; k < unit; ++k) {
    const std::int64_t value = left / kUnits[k].seconds;
    left -= value * kUnits[k].seconds;
    if (value > 0 || !written.empty() || k + 1 == unit) {
      written += fmt::format("{}{}{}", written.empty() ? "" : " ", value, kUnits[k].name);
    }
  }
  out += written;
  i = end;
  return true;
}

// The text with a scaled duration at each place where `begins` is true.
template <typename Begins>
std::string scaled(std::string_view text, double factor, Duration duration, Begins begins) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    if (!begins(i) || !duration(text, i, factor, out)) {
      out += text[i++];
    }
  }
  return out;
}

std::string m73(std::string_view line, double factor) {
  const std::size_t comment = std::min(line.find(';'), line.size());
  return scaled(line.substr(0, comment), factor, number,
                [&](std::size_t i) {
                  const char before = i > 0 ? lower(line[i - 1]) : ' ';
                  return before == 'r' || before == 's' || before == 'c' || before == 'd';
                }) +
         std::string(line.substr(comment));
}

bool starts_with(std::string_view text, std::string_view lower_case) {
  return text.size() >= lower_case.size() &&
         std::equal(lower_case.begin(), lower_case.end(), text.begin(),
                    [](char a, char b) { return a == lower(b); });
}

bool contains(std::string_view text, std::string_view lower_case) {
  return std::search(text.begin(), text.end(), lower_case.begin(), lower_case.end(),
                     [](char a, char b) { return lower(a) == b; }) != text.end();
}

}  // namespace

std::string with_times_scaled(std::string_view line, const TimeFactors& factors) {
  const std::size_t first = std::min(line.find_first_not_of(" \t"), line.size());
  const std::string_view text = line.substr(first);
  if (starts_with(text, "m73") && text.size() > 3 && !is_digit(text[3]) &&
      text.find('*') == std::string_view::npos) {
    return m73(line, factors.left);
  }
  if (!text.starts_with(';')) {
    return std::string(line);
  }
  for (const auto& [key, factor] : {std::pair(std::string_view(";time:"), factors.whole),
                                    std::pair(std::string_view(";time_elapsed:"), factors.gone),
                                    std::pair(std::string_view(";print.time:"), factors.whole)}) {
    if (starts_with(text, key)) {
      const std::size_t at = first + key.size();
      return scaled(line, factor, number, [&](std::size_t i) { return i == at; });
    }
  }
  for (const std::string_view key : {"printing time", "total estimated time"}) {
    if (contains(text, key)) {
      return scaled(line, factors.whole, units, [&](std::size_t i) {
        return i > 1 && line[i - 1] == ' ' && (line[i - 2] == '=' || line[i - 2] == ':');
      });
    }
  }
  return std::string(line);
}

bool same_but_for_times(std::string_view a, std::string_view b) {
  const TimeFactors none = TimeFactors::even(0.0);
  return a == b || with_times_scaled(a, none) == with_times_scaled(b, none);
}

bool tells_time(std::string_view line) {
  const std::size_t first = std::min(line.find_first_not_of(" \t"), line.size());
  const std::string_view text = line.substr(first);
  // Most lines are others, and need not be written anew.
  const bool may = text.starts_with(';') ? contains(text, "time") : starts_with(text, "m73");
  return may && with_times_scaled(line, TimeFactors::even(2.0)) != line;
}

}  // namespace unflex::gcode
