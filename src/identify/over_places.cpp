#include "unflex/identify/over_places.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include "place_product.hpp"
#include "unflex/core/math.hpp"

namespace unflex::identify {
namespace {

constexpr std::string_view kDirections = "xyz";
using ByPlace = std::map<Place, std::vector<const PlacedModel*>>;

double log_hz(const AxisModel& model) { return math::log(model.values().front().freq_hz); }

ByPlace grouped(const std::vector<PlacedModel>& models) {
  ByPlace groups;
  for (const PlacedModel& model : models) {
    groups[model.place_mm].push_back(&model);
  }
  return groups;
}

// The model with its frequencies where the maps have a share of 1. The variance of its frequency
// becomes `unknowns` times as large, since n records share as many unknowns: the fitted frequency
// of a place is known by n / unknowns records on average.
AxisModel at_reference(AxisModel model, double share, Eigen::Index unknowns) {
  for (ModeEstimate& mode : model.modes) {
    mode.freq_hz.value /= share;
    mode.freq_hz.low /= share;
    mode.freq_hz.high /= share;
  }
  for (Plant& plant : model.plants) {
    for (ModeOfAxis& mode : plant.modes) {
      mode.freq_hz /= share;
    }
  }
  const std::size_t count = 3 * model.modes.size();
  const double wider = std::sqrt(static_cast<double>(unknowns));
  for (std::size_t i = 0; i < count; ++i) {
    model.covariance[i] *= wider;
    model.covariance[i * count] *= wider;
  }
  return model;
}

std::string without_map(const std::array<bool, 3>& changes, const Product& product) {
  std::string names;
  for (std::size_t d = 0; d < 3; ++d) {
    if (changes[d] && product.shares[d].empty()) {
      names += fmt::format("{}{}", names.empty() ? "" : " or ", kDirections[d]);
    }
  }
  return names.empty() ? names
                       : fmt::format(
                             "no map along {}: the frequency changes there by less than "
                             "the records can tell",
                             names);
}

Status fill_places(const ByPlace& groups, AxisOverPlaces& all) {
  for (const auto& [place_mm, members] : groups) {
    std::vector<AxisModel> models;
    for (const PlacedModel* const member : members) {
      models.push_back(member->model);
    }
    const bool is_of_one =
        std::ranges::all_of(models, [](const AxisModel& model) { return model.modes.size() == 1; });
    // Where there are several modes, another one may be the main one, and there is no map anyway.
    if (is_of_one && !agree(models)) {
      const auto [low, high] = std::ranges::minmax(
          members, {}, [](const PlacedModel* one) { return log_hz(one->model); });
      return fail(ErrorKind::input, {high->name, 0},
                  fmt::format("tells {:.1f} Hz at {}, but {} tells {:.1f} Hz there; leave out the "
                              "one that is not of today's machine",
                              math::exp(log_hz(high->model)), place_text(place_mm), low->name,
                              math::exp(log_hz(low->model))));
    }
    const AxisModel model = combine(models);
    const ModeEstimate& mode = model.modes.front();
    all.places.push_back({place_mm, members.size(), mode.freq_hz, mode.damping_ratio, 0.0});
  }
  return {};
}

// The model of all records, once the product is taken out of them.
void combine_without(const Product& product, const std::vector<PlacedModel>& models,
                     AxisOverPlaces& all) {
  std::vector<AxisModel> alike;
  for (const PlacedModel& one : models) {
    alike.push_back(at_reference(one.model, product.share_at(one.place_mm), product.unknowns));
  }
  all.model = combine(alike);
  all.agrees = agree(alike);
}

void fill_maps(const Product& product, AxisOverPlaces& all) {
  const double freq_hz = all.model.values().front().freq_hz;
  for (std::size_t d = 0; d < 3; ++d) {
    if (product.shares[d].empty()) {
      continue;
    }
    MapAlong& map = all.maps.emplace_back();
    map.along = kDirections[d];
    for (const auto& [at_mm, log_share] : product.shares[d]) {
      map.at_mm.push_back(at_mm);
      map.freq_hz.push_back(freq_hz * math::exp(log_share));
    }
  }
  for (PlaceOfAxis& one : all.places) {
    one.map_hz = freq_hz * product.share_at(one.place_mm);
  }
}

void warn_of_residual(AxisOverPlaces& all) {
  constexpr double kMost = 0.03;
  const PlaceOfAxis& worst = all.worst();
  if (!all.maps.empty() && std::abs(worst.residual()) > kMost) {
    all.warnings.push_back(fmt::format(
        "the records at {} are {:+.1f} % off the maps, since no product of maps fits all places; "
        "keep dynamics.freq_error no smaller",
        place_text(worst.place_mm), 100.0 * worst.residual()));
  }
}

}  // namespace

const PlaceOfAxis& AxisOverPlaces::worst() const {
  return *std::ranges::max_element(places, {},
                                   [](const PlaceOfAxis& one) { return std::abs(one.residual()); });
}

std::size_t count_places(const std::vector<PlacedModel>& models) { return grouped(models).size(); }

Result<AxisOverPlaces> combine_over_places(const std::vector<PlacedModel>& models) {
  const ByPlace groups = grouped(models);
  if (groups.size() < 2) {
    return fail(ErrorKind::input, {models.empty() ? std::string{} : models.front().name, 0},
                "is of the only place; a map needs records of two or more");
  }
  AxisOverPlaces all;
  if (Status filled = fill_places(groups, all); !filled) {
    return tl::unexpected(filled.error());
  }
  std::array<bool, 3> changes{};
  for (std::size_t d = 0; d < 3; ++d) {
    changes[d] = std::ranges::any_of(all.places, [&](const PlaceOfAxis& one) {
      return one.place_mm[d] != all.places.front().place_mm[d];
    });
  }
  all.reference_mm = reference_of(all.places);
  const std::optional<Product> found = significant_product(all.places, models, changes);
  if (!found) {
    all.warnings.emplace_back(
        "the places leave open along which direction the frequency changes, so there is no map; "
        "take records where one coordinate alone differs");
  }
  Product product = found.value_or(Product{});
  all.remark = found ? without_map(changes, product) : std::string{};
  combine_without(product, models, all);
  if (product.unknowns > 1 && all.model.modes.size() > 1) {
    all.warnings.emplace_back(
        "the axis swings in several modes, and a map can only tell of one, so there is no map");
    product = {};
    combine_without(product, models, all);
  }
  fill_maps(product, all);
  warn_of_residual(all);
  return all;
}

std::string place_text(const Place& place_mm) {
  return fmt::format("{:g}, {:g}, {:g} mm", place_mm[0], place_mm[1], place_mm[2]);
}

}  // namespace unflex::identify
