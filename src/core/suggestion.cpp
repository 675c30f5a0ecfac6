#include "unflex/core/suggestion.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <limits>
#include <numeric>

namespace unflex {
namespace {

// Levenshtein distance: insertions, deletions and substitutions that turn a into b.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({substituted, diagonal + 1, row[j] + 1});
    }
  }
  return row.back();
}

std::string_view last_part(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  return dot == std::string_view::npos ? name : name.substr(dot + 1);
}

std::string_view section_of(std::string_view name) { return name.substr(0, name.rfind('.')); }

// Whether both names begin alike, as "frequency" and "freq_hz" do.
bool begin_alike(std::string_view one, std::string_view other) {
  constexpr std::size_t kLetters = 4;
  return one.size() >= kLetters && other.size() >= kLetters &&
         one.substr(0, kLetters) == other.substr(0, kLetters);
}

// The distance of a key from the typed text. Three cases count as one slip: the same name in
// another section, a name without its unit, and a name that begins alike in the same section.
std::size_t unlikeness(std::string_view typed, std::string_view key) {
  const std::size_t distance = edit_distance(typed, key);
  const bool is_in_section = typed.find('.') != std::string_view::npos &&
                             section_of(key) == section_of(typed) &&
                             begin_alike(last_part(typed), last_part(key));
  if (last_part(typed) == last_part(key) || key.starts_with(fmt::format("{}_", typed)) ||
      is_in_section || (section_of(key) == section_of(typed) && typed.starts_with(key))) {
    return std::min<std::size_t>(distance, 1);
  }
  return distance;
}

}  // namespace

std::string suggestion(std::string_view typed, const std::vector<std::string_view>& names) {
  const std::size_t tolerated = std::max<std::size_t>(1, last_part(typed).size() / 3);
  std::size_t least = std::numeric_limits<std::size_t>::max();
  std::string_view best;
  for (const std::string_view name : names) {
    const std::size_t distance = unlikeness(typed, name);
    // Between equals the nearer spelling wins, so that 'bases.max_velocity' stays in its section.
    if (distance < least ||
        (distance == least && edit_distance(typed, name) < edit_distance(typed, best))) {
      least = distance;
      best = name;
    }
  }
  return least <= tolerated ? fmt::format(", did you mean '{}'?", best) : std::string{};
}

}  // namespace unflex
