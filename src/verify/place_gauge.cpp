#include "place_gauge.hpp"

#include <cmath>

namespace unflex::verify {
namespace {

std::int32_t number_of(double place_mm, double size_mm) {
  return static_cast<std::int32_t>(std::floor(place_mm / size_mm));
}

}  // namespace

PartError PlaceGauge::Sum::error() const {
  return {weight_s > 0.0 ? std::sqrt(contour2_mm2_s / weight_s) : 0.0, weight_s};
}

void PlaceGauge::add(const XY& place_mm, double height_mm, double contour2_mm2, double weight_s) {
  squares_[{number_of(place_mm.y, kSquare_mm), number_of(place_mm.x, kSquare_mm)}].add(contour2_mm2,
                                                                                       weight_s);
  bands_[number_of(height_mm, kBand_mm)].add(contour2_mm2, weight_s);
}

PlaceErrors PlaceGauge::errors() const {
  PlaceErrors errors;
  for (const auto& [at, sum] : squares_) {
    errors.squares.push_back(
        {(at.second + 0.5) * kSquare_mm, (at.first + 0.5) * kSquare_mm, sum.error()});
  }
  for (const auto& [at, sum] : bands_) {
    errors.bands.push_back({at * kBand_mm, sum.error()});
  }
  return errors;
}

}  // namespace unflex::verify
