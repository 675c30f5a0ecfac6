// The rows of the summary that tell of places: height, squares of the bed, and bands of height.
#pragma once

#include <fmt/format.h>

#include <iterator>
#include <optional>
#include <string>

#include "unflex/report/format.hpp"
#include "unflex/verify/measured.hpp"

namespace unflex::report {

// Where the summary's text goes.
using Sink = std::back_insert_iterator<std::string>;

// "12.3 → 0.45", in µm.
[[nodiscard]] inline std::string change_text(double from_mm, double to_mm) {
  return fmt::format("{} → {}", micrometres_text(from_mm), micrometres_text(to_mm));
}

void write_height(Sink out, const std::optional<verify::HeightStats>& before,
                  const std::optional<verify::HeightStats>& after);
void write_places(Sink out, const std::optional<verify::PlaceErrors>& before,
                  const std::optional<verify::PlaceErrors>& after);

}  // namespace unflex::report
