#include "text_places.hpp"

#include <algorithm>
#include <string_view>

#include "unflex/core/math.hpp"

namespace unflex::report {
namespace {

// Squares with less are left out where one square stands for others.
constexpr double kEnough_s = 1.0;

std::size_t middle_of(const verify::PlaceErrors& places) {
  double x_mm = 0.0;
  double y_mm = 0.0;
  for (const verify::PlaceErrors::Square& square : places.squares) {
    x_mm += square.x_mm / static_cast<double>(places.squares.size());
    y_mm += square.y_mm / static_cast<double>(places.squares.size());
  }
  const auto away = [&](const verify::PlaceErrors::Square& square) {
    return math::hypot(square.x_mm - x_mm, square.y_mm - y_mm);
  };
  const auto nearest = std::ranges::min_element(places.squares, {}, away);
  return static_cast<std::size_t>(nearest - places.squares.begin());
}

std::size_t worst_of(const verify::PlaceErrors& places) {
  const auto error = [](const verify::PlaceErrors::Square& square) {
    return square.error.duration_s >= kEnough_s ? square.error.rms_mm : 0.0;
  };
  const auto worst = std::ranges::max_element(places.squares, {}, error);
  return static_cast<std::size_t>(worst - places.squares.begin());
}

}  // namespace

void write_height(Sink out, const std::optional<verify::HeightStats>& before,
                  const std::optional<verify::HeightStats>& after) {
  if (before && after) {
    fmt::format_to(out, "  {:<16}{:<20}{:<20}{}\n", "height",
                   change_text(before->max_mm, after->max_mm), "",
                   change_text(before->rms_mm, after->rms_mm));
  }
}

// The middle of the bed's part that is printed on, beside the square where the nozzle then strays
// most, and the first band of height beside the last.
void write_places(Sink out, const std::optional<verify::PlaceErrors>& before,
                  const std::optional<verify::PlaceErrors>& after) {
  if (!before || !after || before->squares.size() != after->squares.size() ||
      after->squares.empty() || before->bands.size() != after->bands.size()) {
    return;
  }
  const auto row = [&](std::string_view name, const verify::PartError& from,
                       const verify::PartError& to) {
    fmt::format_to(out, "  {:<56}{}\n", name, change_text(from.rms_mm, to.rms_mm));
  };
  const auto square = [&](std::string_view name, std::size_t i) {
    const verify::PlaceErrors::Square& at = after->squares[i];
    row(fmt::format("{}, around X{:.0f} Y{:.0f}", name, at.x_mm, at.y_mm), before->squares[i].error,
        at.error);
  };
  square("the middle of the bed", middle_of(*after));
  square("where it is worst", worst_of(*after));
  if (after->bands.size() > 1) {
    row("the first millimetre of height", before->bands.front().error, after->bands.front().error);
    row("the last one", before->bands.back().error, after->bands.back().error);
  }
}

}  // namespace unflex::report
