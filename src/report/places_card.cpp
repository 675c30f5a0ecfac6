#include "places_card.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "unflex/report/format.hpp"

namespace unflex::report {
namespace {

using verify::PlaceErrors;

struct Extent {
  double left_mm = 0.0;
  double right_mm = 0.0;
  double front_mm = 0.0;
  double back_mm = 0.0;
};

Extent extent_of(const PlaceErrors& places) {
  const double half_mm = 0.5 * verify::kSquare_mm;
  const auto [left, right] = std::ranges::minmax(places.squares, {}, &PlaceErrors::Square::x_mm);
  const auto [front, back] = std::ranges::minmax(places.squares, {}, &PlaceErrors::Square::y_mm);
  return {left.x_mm - half_mm, right.x_mm + half_mm, front.y_mm - half_mm, back.y_mm + half_mm};
}

// The bed from above, with Y upwards. A square is the darker the further the nozzle strays in it,
// up to most_mm.
std::string bed_picture(const PlaceErrors& places, std::string_view name, std::string_view colour,
                        double most_mm) {
  constexpr double kLeast = 0.06;
  const Extent extent = extent_of(places);
  std::string svg = fmt::format(
      "<figure><svg class=\"plot\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "style=\"max-width:22rem\" role=\"img\" aria-label=\"{2}\">",
      extent.right_mm - extent.left_mm, extent.back_mm - extent.front_mm, name);
  for (const PlaceErrors::Square& square : places.squares) {
    const double share =
        most_mm > 0.0 ? std::clamp(square.error.rms_mm / most_mm, kLeast, 1.0) : kLeast;
    svg += fmt::format(
        "<rect x=\"{:.0f}\" y=\"{:.0f}\" width=\"{:.0f}\" height=\"{:.0f}\" "
        "style=\"fill:var({})\" fill-opacity=\"{:.2f}\"><title>X{:.0f} Y{:.0f}: {} µm "
        "RMS</title></rect>",
        square.x_mm - 0.5 * verify::kSquare_mm - extent.left_mm,
        extent.back_mm - square.y_mm - 0.5 * verify::kSquare_mm, verify::kSquare_mm - 1.0,
        verify::kSquare_mm - 1.0, colour, share, square.x_mm, square.y_mm,
        micrometres_text(square.error.rms_mm));
  }
  return svg + fmt::format("</svg><figcaption>{}</figcaption></figure>\n", name);
}

double most_of(const PlaceErrors& places) {
  return std::ranges::max(places.squares, {},
                          [](const PlaceErrors::Square& square) { return square.error.rms_mm; })
      .error.rms_mm;
}

std::string rows_of_bands(const PlaceErrors& before, const PlaceErrors& after) {
  constexpr std::size_t kMost = 12;
  const std::size_t step = std::max<std::size_t>((before.bands.size() + kMost - 1) / kMost, 1);
  std::string rows;
  const auto add = [&](std::size_t i) {
    rows += fmt::format("<tr><td>{:.0f} to {:.0f} mm</td><td>{}</td><td>{}</td></tr>\n",
                        before.bands[i].from_mm, before.bands[i].from_mm + verify::kBand_mm,
                        micrometres_text(before.bands[i].error.rms_mm),
                        micrometres_text(after.bands[i].error.rms_mm));
  };
  for (std::size_t i = 0; i + 1 < before.bands.size(); i += step) {
    add(i);
  }
  add(before.bands.size() - 1);
  return rows;
}

}  // namespace

std::string places_card(const verify::Measured& measured) {
  const auto& before = measured.uncompensated.places;
  const auto& after = measured.compensated.places;
  if (!before || !after || before->squares.empty() || after->squares.empty() ||
      before->bands.size() != after->bands.size()) {
    return {};
  }
  return fmt::format(
      "<section class=\"card\" aria-labelledby=\"places-h\">\n<h2 id=\"places-h\">Over the bed and "
      "the height</h2>\n<p class=\"note\">How far the nozzle is off its path, RMS, in squares of "
      "{:.0f} mm. The frequencies of this machine change with the place, the height or the print. "
      "The darkest square stands for {} µm as sliced and for {} µm as written.</p>\n"
      "<div style=\"display:flex;flex-wrap:wrap;gap:var(--gap)\">{}{}</div>\n"
      "<table><thead><tr><th>height</th><th>as sliced, µm</th><th>as written, µm</th></tr></thead>"
      "<tbody>\n{}</tbody></table>\n</section>\n",
      verify::kSquare_mm, micrometres_text(most_of(*before)), micrometres_text(most_of(*after)),
      bed_picture(*before, "as sliced", "--before", most_of(*before)),
      bed_picture(*after, "as written", "--after", most_of(*after)),
      rows_of_bands(*before, *after));
}

}  // namespace unflex::report
