// The frequency of an axis over the places of its records, as a product of shares:
//   f(x, y, z) = f₀ s_x(x) s_y(y) s_z(z).
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "unflex/identify/axis_model.hpp"

namespace unflex::identify {

// A trusted model of a record, and where the record was taken.
struct PlacedModel {
  std::string name;  // of the record
  Place place_mm{};
  AxisModel model;
};

// The frequency along one direction, where the other directions are as at the place that the
// axis' model is for.
struct MapAlong {
  char along = 'x';             // 'x', 'y' or 'z'
  std::vector<double> at_mm;    // increasing, two or more
  std::vector<double> freq_hz;  // one for each of at_mm
};

// What all records of one place tell together.
struct PlaceOfAxis {
  Place place_mm{};
  std::size_t records = 0;
  Estimate freq_hz;        // of the main mode
  Estimate damping_ratio;  // likewise
  double map_hz = 0.0;     // what model and maps say there

  // How far the records are from the maps, as a share of these.
  [[nodiscard]] double residual() const { return freq_hz.value / map_hz - 1.0; }
};

struct AxisOverPlaces {
  // With maps: the axis at the place nearest to the middle of all places. Every map has the
  // model's frequency there.
  AxisModel model;
  Place reference_mm{};             // that place
  std::vector<MapAlong> maps;       // one at most for each direction; none where nothing changes
  std::vector<PlaceOfAxis> places;  // by x, y and z
  std::string remark;               // which direction has no map, and why; empty: nothing to say
  std::vector<std::string> warnings;
  // Whether the main modes are within 5 % of each other once the maps are taken out of them.
  bool agrees = true;

  // The place where the maps are farthest from the records.
  [[nodiscard]] const PlaceOfAxis& worst() const;
};

// How many places these models are of.
[[nodiscard]] std::size_t count_places(const std::vector<PlacedModel>& models);

// Combines the models of each place, fits the shares to the logarithms of the main modes'
// frequencies, and combines all models once the shares are taken out of them. A direction has no
// map where its shares are within 0.5 %, or within the 95 % interval of their records. Errors are
// of kind input: models of fewer than two places, and models of one place that differ by more than
// 5 %.
[[nodiscard]] Result<AxisOverPlaces> combine_over_places(const std::vector<PlacedModel>& models);

// "100, 50, 20 mm".
[[nodiscard]] std::string place_text(const Place& place_mm);

}  // namespace unflex::identify
