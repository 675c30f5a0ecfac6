// The search for the fastest motion along a section.
//
// Notation:
//   u, h          place among the nodes, and node period (section_nodes.hpp)
//   X, Y, T (u)   flat outputs (flat_output.hpp) and time, splines of degree D
//   p, b, e       nozzle, base, contour error of the nozzle
//   n, P          normal of a leg, and a place on it
//   A, F          limit of b̈, and of ṗ
//
//   min  T(N) − T(0) + r₂ T″² + r₃ (T‴² + T⁗²) + small squares of e and b̈
//   s.t. |b̈| ≤ A,   |n·(p − P)| ≤ tolerance,   |ṗ| ≤ F
//
// Method: sequential quadratic programs (section_program.hpp). Each is linear in the steps of the
// control points, and trusts them only as far as T′ changes by a certain share. This share grows
// where the last step came out as foreseen, and shrinks where it did not (section_rounds.hpp).
//
// The path in time is the same however u is spread over it, so the squares of T‴ and T⁗ keep nodes
// evenly spread.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include "edge_nozzles.hpp"
#include "section_motion.hpp"
#include "section_nodes.hpp"
#include "section_program.hpp"
#include "section_rounds.hpp"
#include "section_spline.hpp"
#include "tunings.hpp"

namespace unflex::timing {

template <int D>
class SectionSearch {
 public:
  using Spline = SectionSpline<D>;

  // Both arguments must outlive this.
  SectionSearch(const Section& section, const SectionRules& rules)
      : section_(section),
        rules_(rules),
        nodes_(
            section,
            Tuned::kNodePeriod_rad /
                most_of_axes([](const dynamics::Mode& mode) { return mode.omega_rad_s; }, rules)),
        spline_(section, rules, nodes_),
        edges_(section, rules),
        rounds_(nodes_.periods(), D != 5),
        program_({section_, rules_, nodes_, spline_, edges_, rounds_}) {}
  SectionSearch(const SectionSearch&) = delete;
  SectionSearch& operator=(const SectionSearch&) = delete;

  // False: nothing was found that keeps the rules.
  [[nodiscard]] bool solve() {
    // The matrix is badly conditioned, so the residual is solved for again.
    for (int i = 0; i < Tuned::kFirstSolutions; ++i) {
      if (!step(true)) {
        return false;
      }
    }
    last_ = duration();
    for (int round = 0; round < Tuned::kRounds; ++round) {
      if (!step(false)) {
        return false;
      }
      measure();
      const bool is_settled = settles();
      if (fine_rounds_ > 0 && (is_settled || fine_rounds_ == Tuned::kFineRounds)) {
        break;
      }
      fine_rounds_ += is_settled || fine_rounds_ > 0 ? 1 : 0;
      if (rounds_.is_stuck(round)) {
        break;
      }
      rounds_.adapt(program_.surprise(), round);
    }
    if (best_.empty()) {
      return false;
    }
    spline_.points() = std::move(best_);
    edges_.follow(spline_);
    return true;
  }

  [[nodiscard]] const Spline& spline() const { return spline_; }
  [[nodiscard]] const SectionNodes& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<dynamics::NozzleXY>& edge_nozzles() const {
    return edges_.ends();
  }

 private:
  using Tuned = OptimalTunings;
  using Shares = typename Spline::Shares;
  using At = SectionPlace<D>;

  // In node periods.
  [[nodiscard]] double duration() const {
    return spline_.clock(nodes_.periods() - 1, at_end_) - spline_.clock(0, at_node_);
  }

  // Keeps the motion of the round if it is the best one. Returns whether the search has settled.
  [[nodiscard]] bool settles() {
    const double gain = last_ - duration();
    last_ = duration();
    bool is_settled = false;
    if (rounds_.is_kept() && last_ < least_) {
      least_ = last_;
      best_ = spline_.points();
      is_settled = gain < Tuned::kGain * last_;
    }
    if (least_ < (1.0 - Tuned::kGain) * least_before_) {
      least_before_ = least_;
      idle_rounds_ = 0;
    } else if (!best_.empty()) {
      is_settled = is_settled || ++idle_rounds_ >= Tuned::kIdleRounds;
    }
    return is_settled;
  }

  // The gap at which the next program counts as solved.
  [[nodiscard]] double gap(bool is_plain) const {
    if (is_plain || fine_rounds_ > 0) {
      return Tuned::kFineGap;
    }
    if (rounds_.is_far()) {
      return Tuned::kFirstGap;
    }
    return D == 5 ? Tuned::kRoughGap : Tuned::kRoughGapOfBand;
  }

  // Solves one program: least squares in the timing as it is, or the next step of all.
  [[nodiscard]] bool step(bool is_plain) {
    if (!program_.step(is_plain, gap(is_plain))) {
      return false;
    }
    edges_.follow(spline_);
    return true;
  }

  // Looks also between the places that rows are for.
  void measure() {
    std::vector<Excess> excess(nodes_.periods());
    const double h = nodes_.period_s();
    for (std::size_t k = 0; k < nodes_.periods(); ++k) {
      for (int look = 0; look < kLooks + (k + 1 == nodes_.periods() ? 1 : 0); ++look) {
        const At here = place_at<D>(nodes_, spline_, k, static_cast<double>(look) / kLooks,
                                    kSharesAtLooks<D>[look]);
        const FlatOutputs<D>& flat = spline_.flat();
        const double a =
            asked_of_motors(Spline::apply(flat.base_accel, here.place), rules_.shares_motors);
        const XY velocity = Spline::apply(flat.nozzle_speed, here.place);
        excess[k].include({a / (rules_.max_accel_mm_s2 * h * h), error(here),
                           length(velocity) / (h * section_.legs[here.leg].feed_mm_s)});
      }
    }
    const double end_excess = excess_at_end(excess);
    rounds_.show(std::move(excess), end_excess);
  }

  // e relative to the tolerance: the largest for the axes as given and at the edges of the band.
  [[nodiscard]] double error(const At& at) const {
    const XY p = spline_.nozzle_mm(at.place);
    const double tolerance = nodes_.tolerance_mm(at.leg, at.k, at.x, Tuned::kBesideInLooks);
    double e = nodes_.error_mm(at.k, at.x, p) / tolerance;
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const XY edge_mm = Spline::apply(edges_.nozzle(i, spline_), at.place);
      const double at_edge =
          nodes_.error_mm(at.k, at.x, spline_.origin() + edge_mm + edges_.left(i, at.k, at.x));
      e = std::max(e, at_edge / edge_tolerance_mm(rules_, tolerance));
    }
    return e;
  }

  // How far the nozzles at the edges of a band stray where the base and its clock are given, and
  // how far they swing after it, relative to their tolerances.
  [[nodiscard]] double excess_at_end(const std::vector<Excess>& of_periods) const {
    if (edges_.size() == 0) {
      return 0.0;
    }
    double excess = 0.0;
    for (std::size_t k = nodes_.periods() - Tuned::kGivenPeriods; k < nodes_.periods(); ++k) {
      excess = std::max(excess, of_periods[k].error);
    }
    if (section_.swing_tolerance_mm) {
      const auto end = spline_.place(nodes_.periods() - 1, at_end_);
      const XY base_mm = spline_.origin() + Spline::apply(spline_.flat().base, end);
      excess = std::max(excess, edges_.largest_swing_mm(base_mm) / *section_.swing_tolerance_mm);
    }
    return excess;
  }

  static constexpr double kInfinity = std::numeric_limits<double>::infinity();

  const Section& section_;
  const SectionRules& rules_;
  SectionNodes nodes_;
  Spline spline_;
  EdgeNozzles<D> edges_;
  Shares at_node_ = spline_shares<D>(0.0);
  Shares at_end_ = spline_shares<D>(1.0);
  SectionRounds rounds_;
  SectionProgram<D> program_;

  // Durations of the last round, of the best one, and of the best one at the last gain.
  double last_ = 0.0;
  double least_ = kInfinity;
  double least_before_ = kInfinity;
  std::vector<double> best_;  // control points; empty: none has kept the rules yet
  int idle_rounds_ = 0;
  int fine_rounds_ = 0;
};

}  // namespace unflex::timing
