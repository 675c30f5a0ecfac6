// How the frequencies of an axis change over the bed, as shares of those that are given for it.
//
//   f(x, y) = f s_x(x) s_y(y)      s  share along X, and share along Y
//
// The equation of motion keeps its form, with ω(t) where the base is at time t: the nozzle is
// within a millimetre of it. Damping ratios stay.
#pragma once

#include <cmath>
#include <map>
#include <span>
#include <vector>

#include "unflex/core/axes.hpp"
#include "unflex/core/math.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::dynamics {

// The value at a place, of values at some places, one or more, which increase: linear between two
// places, and constant beyond the first and the last one.
[[nodiscard]] double between_places(std::span<const double> at_mm, std::span<const double> values,
                                    double place_mm);

// Shares at some places of one direction, as between_places() has them. Without places the share is
// 1.
struct SharesAlong {
  std::vector<double> at_mm;  // increasing
  std::vector<double> share;  // one for each of at_mm

  [[nodiscard]] double at(double place_mm) const;
};

struct FrequencyField : Axes<SharesAlong> {
  // Whether the frequencies are the same everywhere.
  [[nodiscard]] bool is_even() const { return x.at_mm.empty() && y.at_mm.empty(); }
  [[nodiscard]] double at(const XY& place_mm) const { return x.at(place_mm.x) * y.at(place_mm.y); }
};

// Fields of X and of Y.
using FieldXY = Axes<FrequencyField>;

// Steps of one length along an axis whose frequencies are a field, as maps of a kind: NodeMap or
// ExactMap. Each map is made when it is first asked for.
template <class Map>
class FieldMaps {
 public:
  FieldMaps(const FlexibleAxis& axis, const FrequencyField& field, double h)
      : axis_(axis), field_(field), h_(h) {
    present_ = maps_.emplace(0, Map(axis, h)).first;
  }
  // The present map is one of its own.
  FieldMaps(const FieldMaps&) = delete;
  FieldMaps& operator=(const FieldMaps&) = delete;
  FieldMaps(FieldMaps&&) = default;
  FieldMaps& operator=(FieldMaps&&) = default;

  // The map for the frequencies at this place, which are met within 0.01 %.
  [[nodiscard]] const Map& at(const XY& place_mm) {
    constexpr double kSame = 2e-4;
    if (!field_.is_even()) {
      const long step = std::lround(math::log(field_.at(place_mm)) / kSame);
      if (step != present_->first) {
        present_ = maps_.find(step);
        if (present_ == maps_.end()) {
          const double share = math::exp(kSame * static_cast<double>(step));
          present_ = maps_.emplace(step, Map(axis_.detuned(share), h_)).first;
        }
      }
    }
    return present_->second;
  }

 private:
  using Maps = std::map<long, Map>;

  FlexibleAxis axis_;
  FrequencyField field_;
  double h_ = 0.0;
  Maps maps_;  // by steps of the share
  typename Maps::iterator present_;
};

}  // namespace unflex::dynamics
