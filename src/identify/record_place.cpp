// Places in the names of records. Klipper's get_filename() (klippy/extras/resonance_tester.py)
// writes "_%.3f_%.3f_%.3f" behind the axis and the chip.
#include <algorithm>
#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "unflex/core/number.hpp"
#include "unflex/identify/record.hpp"

namespace unflex::identify {
namespace {

constexpr std::string_view kAt = "at";

// The parts between underlines, and between the brackets that name a column of a file.
std::vector<std::string_view> parts_of(std::string_view name) {
  constexpr std::string_view kEnding = ".csv";
  std::vector<std::string_view> parts;
  while (!name.empty()) {
    const std::size_t end = std::min(name.find_first_of("_ ()"), name.size());
    std::string_view part = name.substr(0, end);
    if (part.ends_with(kEnding)) {
      part.remove_suffix(kEnding.size());
    }
    parts.push_back(part);
    name.remove_prefix(std::min(end + 1, name.size()));
  }
  return parts;
}

// Klipper writes three decimals. Whole numbers may be a date, so they count behind "at" alone.
bool is_of_klipper(std::string_view part) {
  const std::size_t point = part.find('.');
  return point != std::string_view::npos && part.size() - point == 4;
}

std::optional<Place> place_of(std::span<const std::string_view> parts) {
  Place place_mm{};
  for (std::size_t d = 0; d < place_mm.size(); ++d) {
    const std::optional<double> value = parse_number(parts[d]);
    if (!value) {
      return std::nullopt;
    }
    place_mm[d] = *value;
  }
  return place_mm;
}

}  // namespace

std::optional<Place> place_in_name(std::string_view file) {
  const std::vector<std::string_view> parts = parts_of(file.substr(file.rfind('/') + 1));
  constexpr std::size_t kNumbers = std::tuple_size_v<Place>;
  std::optional<Place> found;
  for (std::size_t i = 0; i + kNumbers <= parts.size(); ++i) {
    const std::span<const std::string_view> numbers(&parts[i], kNumbers);
    if ((i > 0 && parts[i - 1] == kAt) || std::ranges::all_of(numbers, is_of_klipper)) {
      // The name of a column stands behind that of its file, and tells more.
      found = place_of(numbers) ? place_of(numbers) : found;
    }
  }
  return found;
}

}  // namespace unflex::identify
