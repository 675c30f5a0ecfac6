#include "unflex/filament/profile.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string_view>

#include "unflex/core/number.hpp"

namespace unflex::filament {
namespace {

constexpr std::string_view kBetween = ",; \t\r";

std::vector<std::string_view> cells_of(std::string_view line) {
  std::vector<std::string_view> cells;
  for (std::size_t at = line.find_first_not_of(kBetween); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBetween, at), line.size());
    cells.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBetween, end);
  }
  return cells;
}

struct Columns {
  std::size_t count = 0;
  std::size_t place = 0;
  std::size_t section = 0;
  bool is_diameter = false;
};

std::optional<Columns> columns_of(const std::vector<std::string_view>& names) {
  Columns columns{names.size(), names.size(), names.size()};
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (names[i] == "mm") {
      columns.place = i;
    } else if (names[i] == "area_mm2" || names[i] == "diameter_mm") {
      if (columns.section < names.size()) {
        return std::nullopt;
      }
      columns.section = i;
      columns.is_diameter = names[i] == "diameter_mm";
    }
  }
  if (columns.place == names.size() || columns.section == names.size()) {
    return std::nullopt;
  }
  return columns;
}

}  // namespace

double area_of_diameter_mm2(double diameter_mm) {
  return std::numbers::pi / 4.0 * diameter_mm * diameter_mm;
}

Profile::Profile(double area_mm2) : places_{{0.0, area_mm2, 0.0}} {}

Result<Profile> Profile::read(std::istream& table, const std::string& name) {
  std::vector<Place> places;
  std::optional<Columns> columns;
  std::size_t number = 0;
  const auto wrong = [&](std::string what) {
    return fail(ErrorKind::input, {name, number}, std::move(what));
  };
  for (std::string line; std::getline(table, line);) {
    ++number;
    const std::vector<std::string_view> cells = cells_of(line);
    if (cells.empty() || cells.front().starts_with('#')) {
      continue;
    }
    if (!columns) {
      columns = columns_of(cells);
      if (!columns) {
        return wrong(
            "is not a profile's first line; name its columns mm and area_mm2 or "
            "diameter_mm");
      }
      continue;
    }
    if (cells.size() != columns->count) {
      return wrong(fmt::format("has {} columns, not {} as the first line; give each place a line",
                               cells.size(), columns->count));
    }
    const std::optional<double> at_mm = parse_number(cells[columns->place]);
    const std::optional<double> section = parse_number(cells[columns->section]);
    if (!at_mm || !section) {
      return wrong("has no number where one is needed; write numbers as 12.5");
    }
    if (!(*section > 0.0)) {
      return wrong("has a section of nothing; leave out what could not be measured");
    }
    const double area_mm2 = columns->is_diameter ? area_of_diameter_mm2(*section) : *section;
    Place place{*at_mm, area_mm2, 0.0};
    if (!places.empty()) {
      const Place& last = places.back();
      if (!(place.at_mm > last.at_mm)) {
        return wrong("is not behind the place before; sort the places along the filament");
      }
      place.before_mm3 = last.before_mm3 + 0.5 * (last.area_mm2 + area_mm2) * (*at_mm - last.at_mm);
    }
    places.push_back(place);
  }
  if (table.bad()) {
    return fail(ErrorKind::input, {name, 0}, "cannot be read to its end");
  }
  if (places.empty()) {
    return fail(ErrorKind::input, {name, 0},
                "has no place; give columns mm and area_mm2, and a line for each place");
  }
  return Profile(std::move(places));
}

double Profile::area_mm2(double at_mm) const {
  const auto next = std::ranges::upper_bound(places_, at_mm, {}, &Place::at_mm);
  if (next == places_.begin() || next == places_.end()) {
    return next == places_.end() ? places_.back().area_mm2 : next->area_mm2;
  }
  const Place& last = *(next - 1);
  const double share = (at_mm - last.at_mm) / (next->at_mm - last.at_mm);
  return last.area_mm2 + share * (next->area_mm2 - last.area_mm2);
}

double Profile::volume_to_mm3(double at_mm) const {
  const auto next = std::ranges::upper_bound(places_, at_mm, {}, &Place::at_mm);
  if (next == places_.begin()) {
    return next->area_mm2 * (at_mm - next->at_mm);
  }
  const Place& last = *(next - 1);
  return last.before_mm3 + 0.5 * (last.area_mm2 + area_mm2(at_mm)) * (at_mm - last.at_mm);
}

double Profile::volume_mm3(double from_mm, double to_mm) const {
  return volume_to_mm3(to_mm) - volume_to_mm3(from_mm);
}

double Profile::length_mm(double from_mm, double volume_mm3) const {
  const double wanted_mm3 = volume_to_mm3(from_mm) + volume_mm3;
  const auto next = std::ranges::upper_bound(places_, wanted_mm3, {}, &Place::before_mm3);
  if (next == places_.begin()) {
    return next->at_mm + wanted_mm3 / next->area_mm2 - from_mm;
  }
  const Place& last = *(next - 1);
  const double left_mm3 = wanted_mm3 - last.before_mm3;
  const double slope_mm =
      next == places_.end() ? 0.0 : (next->area_mm2 - last.area_mm2) / (next->at_mm - last.at_mm);
  // A x + slope x²/2 = V, in the form that does not cancel where the slope is small.
  const double root =
      std::sqrt(std::max(last.area_mm2 * last.area_mm2 + 2.0 * slope_mm * left_mm3, 0.0));
  return last.at_mm + 2.0 * left_mm3 / (last.area_mm2 + root) - from_mm;
}

}  // namespace unflex::filament
