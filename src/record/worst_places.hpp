// The places where the nozzle strays most, each listed once. Candidates near each other count as
// one place, even on different layers.
#pragma once

#include <cstddef>
#include <vector>

#include "moment_ring.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/report/recording.hpp"

namespace unflex::record {

struct PlaceCandidate {
  double contour2_mm2 = 0.0;
  PathPoint where;
  std::size_t line = 0;
  std::size_t layer = 0;
  std::size_t feature = 0;
  XY xy_mm;
  double z_mm = 0.0;
};

class WorstPlaces {
 public:
  explicit WorstPlaces(std::size_t most) : most_(most) {}

  struct Change {
    bool added = false;
    std::vector<std::size_t> removed;
  };
  // Adds the candidate under the number id, if it is among the worst.
  Change add(const PlaceCandidate& candidate, std::size_t id);

  void clear() { places_.clear(); }

  struct Kept {
    std::size_t id;
    PlaceCandidate candidate;
  };
  // The worst first.
  [[nodiscard]] const std::vector<Kept>& places() const { return places_; }
  // Whether a candidate with this deviation might be among the worst.
  [[nodiscard]] bool may_have(double contour2_mm2) const {
    return places_.size() < most_ || contour2_mm2 > places_.back().candidate.contour2_mm2;
  }

 private:
  std::size_t most_;
  std::vector<Kept> places_;
};

}  // namespace unflex::record
