// The nozzles of axes that are not quite as given, on the same base.
//
// To first order such a nozzle is off·∂p/∂ln ω away (flat_output.hpp). What is left of the
// distance, d, is small, and is taken from the last motion found.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "nozzle_measure.hpp"
#include "section_motion.hpp"
#include "section_nodes.hpp"
#include "section_spline.hpp"
#include "unflex/core/math.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::timing {

template <int D>
class EdgeNozzles {
 public:
  EdgeNozzles(const Section& section, const SectionRules& rules)
      : section_(section), edges_(rules.edges) {}

  [[nodiscard]] std::size_t size() const { return edges_.size(); }

  // Follows the nozzles along the motion.
  void follow(const SectionSpline<D>& spline) {
    left_.assign(edges_.size(), {});
    ends_.clear();
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      ends_.push_back(follow(spline, i));
    }
  }

  // The nozzles at the end of the motion.
  [[nodiscard]] const std::vector<dynamics::NozzleXY>& ends() const { return ends_; }

  // How far they swing if the base rests there from then on.
  [[nodiscard]] double largest_swing_mm(Vector base_mm) const {
    double largest = 0.0;
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      largest = std::max(largest, math::hypot(swing_mm(edges_[i].x, ends_[i].x, base_mm.x),
                                              swing_mm(edges_[i].y, ends_[i].y, base_mm.y)));
    }
    return largest;
  }

  // d of nozzle i at u; 0 before follow().
  [[nodiscard]] Vector left(std::size_t i, std::size_t k, double x) const {
    if (left_.empty()) {
      return {};
    }
    const double look = x * kLooks;
    const auto first = std::min(static_cast<std::size_t>(look), std::size_t{kLooks} - 1);
    const double share = look - static_cast<double>(first);
    const Vector& a = left_[i][kLooks * k + first];
    const Vector& b = left_[i][kLooks * k + first + 1];
    return {a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)};
  }

  // Factors of the flat outputs for nozzle i, to first order.
  [[nodiscard]] Derivatives<D> nozzle_x(std::size_t i, const SectionSpline<D>& spline) const {
    return shifted(spline.x(), edges_[i].off_x);
  }
  [[nodiscard]] Derivatives<D> nozzle_y(std::size_t i, const SectionSpline<D>& spline) const {
    return shifted(spline.y(), edges_[i].off_y);
  }

 private:
  static Derivatives<D> shifted(const FlatOutput<D>& flat, double off) {
    Derivatives<D> factors = flat.nozzle;
    for (int i = 0; i < D; ++i) {
      factors[i] += off * flat.sensitivity[i];
    }
    return factors;
  }

  // The base at one look.
  struct Base {
    double time_s = 0.0;
    dynamics::BaseSegment x;
    dynamics::BaseSegment y;
  };

  static Base base_at(const SectionSpline<D>& spline, std::size_t k, const SplineShares<D>& shares,
                      const typename SectionSpline<D>::Place& at) {
    using Spline = SectionSpline<D>;
    const double h = spline.period_s();
    const Vector place = Spline::apply(spline.x().base, spline.y().base, at);
    const Vector speed = Spline::apply(spline.x().base_speed, spline.y().base_speed, at);
    const Vector accel = Spline::apply(spline.x().base_accel, spline.y().base_accel, at);
    return {spline.clock(k, shares) * h,
            {spline.origin().x + place.x, speed.x / h, accel.x / (h * h)},
            {spline.origin().y + place.y, speed.y / h, accel.y / (h * h)}};
  }

  dynamics::NozzleXY follow(const SectionSpline<D>& spline, std::size_t i) {
    const SectionEdge& edge = edges_[i];
    dynamics::NozzleXY nozzle;
    const Vector origin = spline.origin();
    Base last;
    const Derivatives<D> of_x = shifted(spline.x(), edge.off_x);
    const Derivatives<D> of_y = shifted(spline.y(), edge.off_y);
    for (std::size_t look = 0; look <= kLooks * spline.periods(); ++look) {
      const std::size_t k = std::min(look / kLooks, spline.periods() - 1);
      const SplineShares<D>& shares = kSharesAtLooks<D>[look - kLooks * k];
      const auto at = spline.place(k, shares);
      const Base now = base_at(spline, k, shares, at);
      const Vector foreseen = SectionSpline<D>::apply(of_x, of_y, at);
      if (look == 0) {
        nozzle = start(i, now, foreseen, origin);
      } else {
        const double step_s = now.time_s - last.time_s;
        nozzle.x = dynamics::exact_step(edge.x, nozzle.x, between(last.x, now.x), step_s);
        nozzle.y = dynamics::exact_step(edge.y, nozzle.y, between(last.y, now.y), step_s);
      }
      left_[i].push_back({nozzle.x.position() - origin.x - foreseen.x,
                          nozzle.y.position() - origin.y - foreseen.y});
      last = now;
    }
    return nozzle;
  }

  [[nodiscard]] dynamics::NozzleXY start(std::size_t i, const Base& base, Vector foreseen,
                                         Vector origin) const {
    if (!section_.edge_nozzles.empty()) {
      return section_.edge_nozzles[i];
    }
    dynamics::NozzleXY nozzle{edges_[i].x.riding(base.x.position, base.x.velocity),
                              edges_[i].y.riding(base.y.position, base.y.velocity)};
    if (section_.nozzle) {
      nozzle.x.parts[0] = {origin.x + foreseen.x, section_.nozzle->x.velocity};
      nozzle.y.parts[0] = {origin.y + foreseen.y, section_.nozzle->y.velocity};
    }
    return nozzle;
  }

  static dynamics::BaseSegment between(const dynamics::BaseSegment& a,
                                       const dynamics::BaseSegment& b) {
    return {a.position, a.velocity, 0.5 * (a.acceleration + b.acceleration)};
  }

  const Section& section_;
  std::vector<SectionEdge> edges_;
  std::vector<dynamics::NozzleXY> ends_;
  std::vector<std::vector<Vector>> left_;  // of each edge, kLooks times per period
};

}  // namespace unflex::timing
