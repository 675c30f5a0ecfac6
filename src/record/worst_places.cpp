#include "worst_places.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::record {
namespace {

constexpr double kSamePlace_mm = 2.0;

}  // namespace

WorstPlaces::Change WorstPlaces::add(const PlaceCandidate& candidate, std::size_t id) {
  Change change;
  if (!may_have(candidate.contour2_mm2)) {
    return change;
  }
  const auto is_near = [&](const Kept& kept) {
    return distance(candidate.xy_mm, kept.candidate.xy_mm) < kSamePlace_mm;
  };
  const bool known = std::any_of(places_.begin(), places_.end(), [&](const Kept& kept) {
    return is_near(kept) && kept.candidate.contour2_mm2 >= candidate.contour2_mm2;
  });
  if (known) {
    return change;
  }
  std::erase_if(places_, [&](const Kept& kept) {
    const bool replaced = is_near(kept);
    if (replaced) {
      change.removed.push_back(kept.id);
    }
    return replaced;
  });
  const auto behind = std::find_if(places_.begin(), places_.end(), [&](const Kept& kept) {
    return kept.candidate.contour2_mm2 < candidate.contour2_mm2;
  });
  places_.insert(behind, {id, candidate});
  change.added = true;
  if (places_.size() > most_) {
    change.removed.push_back(places_.back().id);
    places_.pop_back();
  }
  return change;
}

}  // namespace unflex::record
