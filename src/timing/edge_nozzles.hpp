// The nozzles of axes that are not quite as given, on the same base.
//
// To first order, the nozzle of an axis whose ω differs by the share `off` is off·∂p/∂ln ω away
// (flat_output.hpp). The rest of the distance, d, is small and is taken from the last motion found.
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
#include "unflex/core/axes.hpp"
#include "unflex/core/xy.hpp"
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

  // The largest swing of these nozzles if the base rests at base_mm from then on.
  [[nodiscard]] double largest_swing_mm(XY base_mm) const {
    double largest = 0.0;
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      largest = std::max(largest, length(map_axes(swing_mm, edges_[i], ends_[i], base_mm)));
    }
    return largest;
  }

  // d of nozzle i at u; 0 before follow().
  [[nodiscard]] XY left(std::size_t i, std::size_t k, double x) const {
    if (left_.empty()) {
      return {};
    }
    const double look = x * kLooks;
    const auto first = std::min(static_cast<std::size_t>(look), std::size_t{kLooks} - 1);
    const double share = look - static_cast<double>(first);
    const XY& a = left_[i][kLooks * k + first];
    const XY& b = left_[i][kLooks * k + first + 1];
    return a + share * (b - a);
  }

  // Factors of the flat outputs for nozzle i, to first order.
  [[nodiscard]] Axes<Derivatives<D>> nozzle(std::size_t i, const SectionSpline<D>& spline) const {
    const FlatOutputs<D>& flat = spline.flat();
    return map_axes(shifted, flat.nozzle, flat.sensitivity, edges_[i].off);
  }

 private:
  static Derivatives<D> shifted(const Derivatives<D>& nozzle, const Derivatives<D>& sensitivity,
                                double off) {
    Derivatives<D> factors = nozzle;
    for (int i = 0; i < D; ++i) {
      factors[i] += off * sensitivity[i];
    }
    return factors;
  }

  // The base at one look.
  using Base = Axes<dynamics::BaseSegment>;

  static Base base_at(const SectionSpline<D>& spline, const typename SectionSpline<D>::Place& at) {
    using Spline = SectionSpline<D>;
    const double h = spline.period_s();
    const FlatOutputs<D>& flat = spline.flat();
    return map_axes(
        [](double place, double speed, double accel) {
          return dynamics::BaseSegment{place, speed, accel};
        },
        spline.origin() + Spline::apply(flat.base, at), Spline::apply(flat.base_speed, at) / h,
        Spline::apply(flat.base_accel, at) / (h * h));
  }

  dynamics::NozzleXY follow(const SectionSpline<D>& spline, std::size_t i) {
    const SectionEdge& edge = edges_[i];
    dynamics::NozzleXY nozzle;
    const XY origin = spline.origin();
    Base last;
    double last_s = 0.0;
    const Axes<Derivatives<D>> of_edge = this->nozzle(i, spline);
    for (std::size_t look = 0; look <= kLooks * spline.periods(); ++look) {
      const std::size_t k = std::min(look / kLooks, spline.periods() - 1);
      const SplineShares<D>& shares = kSharesAtLooks<D>[look - kLooks * k];
      const auto at = spline.place(k, shares);
      const Base now = base_at(spline, at);
      const double now_s = spline.clock(k, shares) * spline.period_s();
      const XY foreseen = SectionSpline<D>::apply(of_edge, at);
      if (look == 0) {
        nozzle = start(i, now, origin + foreseen);
      } else {
        const double step_s = now_s - last_s;
        for_each_axis(
            [&](dynamics::NozzleState& state, const dynamics::FlexibleAxis& axis,
                const dynamics::BaseSegment& from, const dynamics::BaseSegment& to) {
              state = dynamics::exact_step(axis, state, between(from, to), step_s);
            },
            nozzle, edge, last, now);
      }
      left_[i].push_back(dynamics::place_mm(nozzle) - origin - foreseen);
      last = now;
      last_s = now_s;
    }
    return nozzle;
  }

  [[nodiscard]] dynamics::NozzleXY start(std::size_t i, const Base& base,
                                         const XY& foreseen_mm) const {
    if (!section_.edge_nozzles.empty()) {
      return section_.edge_nozzles[i];
    }
    dynamics::NozzleXY nozzle =
        dynamics::riding(edges_[i], dynamics::place_mm(base), dynamics::velocity_mm_s(base));
    if (section_.nozzle) {
      for_each_axis(
          [](dynamics::NozzleState& state, double place_mm, const dynamics::NozzleMotion& swing) {
            state.parts[0] = {place_mm, swing.velocity};
          },
          nozzle, foreseen_mm, *section_.nozzle);
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
  std::vector<std::vector<XY>> left_;  // of each edge, kLooks times per period
};

}  // namespace unflex::timing
