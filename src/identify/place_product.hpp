// The frequency over places as a product of one share for each direction.
#pragma once

#include <Eigen/Core>
#include <array>
#include <map>
#include <optional>
#include <vector>

#include "unflex/identify/over_places.hpp"

namespace unflex::identify {

// The logarithms of one direction's shares, by coordinate in mm.
using Shares = std::map<double, double>;

struct Product {
  std::array<Shares, 3> shares;  // empty: no map along this direction
  Eigen::Index unknowns = 1;

  [[nodiscard]] double share_at(const Place& place_mm) const;
};

// The place nearest to the middle between the outermost coordinates; the first of several as near.
[[nodiscard]] Place reference_of(const std::vector<PlaceOfAxis>& places);

// The product over the directions that `changes` names, without those along which the shares are
// within 0.5 %, or within the 95 % interval of their records. A product without any direction: all
// places are as near to each other. Nothing where the places leave open
// along which direction the frequency changes.
[[nodiscard]] std::optional<Product> significant_product(const std::vector<PlaceOfAxis>& places,
                                                         const std::vector<PlacedModel>& models,
                                                         std::array<bool, 3> changes);

}  // namespace unflex::identify
