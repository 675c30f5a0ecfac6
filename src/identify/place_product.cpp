// Notation: l_k the logarithm of the frequency at place k, n_k its records. The shares minimise
//   Σ_k n_k (l_k − log f₀ − Σ_d log s_d(place_k,d))²,
// with s_d = 1 at the coordinates of the reference, the place nearest to the middle. The unknowns
// are log f₀ and log s_d at each other coordinate.
#include "place_product.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "unflex/core/math.hpp"

namespace unflex::identify {
namespace {

// A change by less than this share is not worth a map: two tests of one machine differ by as much.
constexpr double kNothing = 0.005;

// The product over the directions that `has` names. Nothing where the places leave open along
// which of them the frequency changes.
std::optional<Product> product_of(const std::vector<PlaceOfAxis>& places,
                                  const std::array<bool, 3>& has) {
  const Place reference_mm = reference_of(places);
  Product product;
  std::array<std::map<double, Eigen::Index>, 3> columns;
  for (std::size_t d = 0; d < 3; ++d) {
    for (const PlaceOfAxis& one : places) {
      const double at_mm = one.place_mm[d];
      if (has[d] && at_mm != reference_mm[d] && !columns[d].contains(at_mm)) {
        columns[d][at_mm] = product.unknowns++;
      }
    }
  }
  const auto rows = static_cast<Eigen::Index>(places.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(rows, product.unknowns);
  Eigen::VectorXd right(rows);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const PlaceOfAxis& one = places[static_cast<std::size_t>(k)];
    const double weight = std::sqrt(static_cast<double>(one.records));
    right[k] = weight * math::log(one.freq_hz.value);
    matrix(k, 0) = weight;
    for (std::size_t d = 0; d < 3; ++d) {
      if (const auto column = columns[d].find(one.place_mm[d]); column != columns[d].end()) {
        matrix(k, column->second) = weight;
      }
    }
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(matrix);
  if (factors.rank() < product.unknowns) {
    return std::nullopt;
  }
  const Eigen::VectorXd solved = factors.solve(right);
  for (std::size_t d = 0; d < 3; ++d) {
    for (const auto& [at_mm, column] : columns[d]) {
      product.shares[d][at_mm] = solved[column];
    }
    if (has[d]) {
      product.shares[d][reference_mm[d]] = 0.0;
    }
  }
  return product;
}

double range_of(const Shares& shares) {
  const auto [least, most] = std::ranges::minmax_element(shares, {}, &Shares::value_type::second);
  return most->second - least->second;
}

// The 95 % interval of a record's frequency, as a share: the median over the records, so that a
// single bad one does not hide what the others tell.
double interval_of(const std::vector<PlacedModel>& models) {
  std::vector<double> widths;
  for (const PlacedModel& one : models) {
    const Estimate& freq_hz = one.model.modes.front().freq_hz;
    widths.push_back(math::log(freq_hz.high / freq_hz.low));
  }
  const auto middle = widths.begin() + static_cast<std::ptrdiff_t>(widths.size() / 2);
  std::ranges::nth_element(widths, middle);
  return *middle;
}

}  // namespace

// The middle between the outermost coordinates does not depend on where more places were tested.
Place reference_of(const std::vector<PlaceOfAxis>& places) {
  Place middle_mm{};
  for (std::size_t d = 0; d < middle_mm.size(); ++d) {
    const auto [least, most] =
        std::ranges::minmax(places, {}, [&](const PlaceOfAxis& one) { return one.place_mm[d]; });
    middle_mm[d] = 0.5 * (least.place_mm[d] + most.place_mm[d]);
  }
  return std::ranges::min_element(places, {},
                                  [&](const PlaceOfAxis& one) {
                                    return math::hypot(one.place_mm[0] - middle_mm[0],
                                                       one.place_mm[1] - middle_mm[1],
                                                       one.place_mm[2] - middle_mm[2]);
                                  })
      ->place_mm;
}

double Product::share_at(const Place& place_mm) const {
  double sum = 0.0;
  for (std::size_t d = 0; d < shares.size(); ++d) {
    sum += shares[d].empty() ? 0.0 : shares[d].at(place_mm[d]);
  }
  return math::exp(sum);
}

std::optional<Product> significant_product(const std::vector<PlaceOfAxis>& places,
                                           const std::vector<PlacedModel>& models,
                                           std::array<bool, 3> changes) {
  const double interval = interval_of(models);
  const auto hz_at = [](const PlaceOfAxis& one) { return one.freq_hz.value; };
  const auto [slowest, fastest] = std::ranges::minmax(places, {}, hz_at);
  if (math::log(hz_at(fastest) / hz_at(slowest)) < std::max(kNothing, interval)) {
    return Product{};
  }
  for (;;) {
    std::optional<Product> product = product_of(places, changes);
    std::size_t dropped = changes.size();
    double least = 1.0;
    for (std::size_t d = 0; product && d < changes.size(); ++d) {
      if (!changes[d]) {
        continue;
      }
      // Each share is of as many records as there are for a coordinate.
      const double coordinates = static_cast<double>(product->shares[d].size());
      const double chance = interval * std::sqrt(coordinates / static_cast<double>(models.size()));
      const double change = range_of(product->shares[d]) / std::max(kNothing, chance);
      if (change < least) {
        least = change;
        dropped = d;
      }
    }
    if (dropped == changes.size()) {
      return product;
    }
    changes[dropped] = false;
  }
}

}  // namespace unflex::identify
