#include "unflex/run/travel_check.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <string_view>

namespace unflex::run {
namespace {

constexpr double kOnTheEdge_mm = 1e-3;

void append(std::string& text, const std::string& word) {
  text += text.empty() ? word : " " + word;
}

}  // namespace

TravelCheck::TravelCheck(const verify::TravelLimits& limits)
    : sides_(map_axes([](const verify::TravelRange& limit) { return Side{limit}; }, limits)) {}

// Whether the place is outside.
bool TravelCheck::Side::add(double at_mm) {
  const double below_mm = limit.min_assumed ? 0.0 : limit.min_mm - at_mm;
  const double above_mm = at_mm - limit.max_mm;
  under_mm = std::max(under_mm, below_mm);
  over_mm = std::max(over_mm, above_mm);
  return std::max(below_mm, above_mm) > kOnTheEdge_mm;
}

bool TravelCheck::Side::is_left() const { return std::max(under_mm, over_mm) > kOnTheEdge_mm; }

// The place that is furthest out.
double TravelCheck::Side::furthest_mm() const {
  return over_mm > under_mm ? limit.max_mm + over_mm : limit.min_mm - under_mm;
}

void TravelCheck::add(const gcode::Event& event) {
  bool outside = false;
  for (const gcode::Segment& segment : event.segments) {
    if (segment.moves_xy()) {
      for_each_axis([&](Side& side, double end_mm) { outside = side.add(end_mm) || outside; },
                    sides_, xy_of(segment.end_mm));
    }
  }
  if (outside && moves_++ == 0) {
    first_line_ = event.line.number;
  }
}

std::optional<Diagnostic> TravelCheck::warning(const std::string& file) const {
  if (moves_ == 0) {
    return std::nullopt;
  }
  std::string travel;
  std::string reach;
  for_each_axis(
      [&](std::string_view letter, const Side& side) {
        const auto [min_mm, max_mm, min_assumed] = side.limit;
        if (max_mm < verify::TravelRange{}.max_mm) {
          append(travel, fmt::format("{}{:.6g}..{:.6g}", letter, min_mm, max_mm));
        }
        if (side.is_left()) {
          append(reach, fmt::format("{}{:.6g}", letter, side.furthest_mm()));
        }
      },
      kAxisLetters, sides_);
  return Diagnostic{
      {file, first_line_},
      fmt::format("{} the printer's travel of {}, first in line {}, as far as {}: the printer "
                  "refuses such moves or cuts them off; slice for this printer's bed, or correct "
                  "printer.travel_x_mm and printer.travel_y_mm if they are wrong",
                  moves_ == 1 ? "1 move leaves" : fmt::format("{} moves leave", moves_), travel,
                  first_line_, reach)};
}

}  // namespace unflex::run
