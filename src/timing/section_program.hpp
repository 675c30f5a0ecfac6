// The quadratic program of one round of a section's search: its squares, its rows, and the accuracy
// with which it has foreseen the motion. section_search.hpp has the notation.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "bounded_plan.hpp"
#include "edge_nozzles.hpp"
#include "section_ends.hpp"
#include "section_motion.hpp"
#include "section_nodes.hpp"
#include "section_rounds.hpp"
#include "section_spline.hpp"
#include "tunings.hpp"
#include "unflex/core/math.hpp"
#include "unflex/quadratic/elastic_program.hpp"

namespace unflex::timing {

// The parts of a search that its programs are made from.
template <int D>
struct SectionState {
  const Section& section;
  const SectionRules& rules;
  const SectionNodes& nodes;
  SectionSpline<D>& spline;
  const EdgeNozzles<D>& edges;
  const SectionRounds& rounds;
};

// The tolerance of the nozzles at the edges of a band.
[[nodiscard]] inline double edge_tolerance_mm(const SectionRules& rules, double tolerance_mm) {
  return std::min(rules.times_tolerance * tolerance_mm, kTravelTolerance_mm);
}

// One u, and the motion there.
template <int D>
struct SectionPlace {
  std::size_t k = 0;
  double x = 0.0;
  const SplineShares<D>* shares = nullptr;
  typename SectionSpline<D>::Place place;
  std::size_t leg = 0;
};

template <int D>
[[nodiscard]] SectionPlace<D> place_at(const SectionNodes& nodes, const SectionSpline<D>& spline,
                                       std::size_t k, double x, const SplineShares<D>& shares) {
  SectionPlace<D> result{k, x, &shares, spline.place(k, shares)};
  result.leg = nodes.nearest_leg(k, x, spline.nozzle_mm(result.place));
  return result;
}

template <int D>
class SectionProgram {
 public:
  using Spline = SectionSpline<D>;
  using Shares = typename Spline::Shares;

  // All members of the state must outlive this.
  explicit SectionProgram(const SectionState<D>& state)
      : section_(state.section),
        rules_(state.rules),
        nodes_(state.nodes),
        spline_(state.spline),
        edges_(state.edges),
        rounds_(state.rounds),
        ends_(state.section, state.nodes.periods()) {
    for (const SectionNodes::Pin& pin : nodes_.pins()) {
      pin_shares_.push_back(spline_shares<D>(pin.x));
    }
  }

  // Builds the program around the present motion, solves it up to the gap, and moves the control
  // points. is_plain: least squares in the timing as it is, without rows. False: it has no
  // solution.
  [[nodiscard]] bool step(bool is_plain, double gap) {
    is_plain_ = is_plain;
    build();
    int iterations = 0;
    const std::optional<std::span<const double>> step = program_.solve(gap, iterations);
    if (!step) {
      return false;
    }
    ends_.take(*step, spline_.points());
    compare();
    return true;
  }

  // By how much the last step has come out otherwise than foreseen, per period.
  [[nodiscard]] const std::vector<double>& surprise() const { return surprise_; }

 private:
  using Tuned = OptimalTunings;
  using Values = typename Spline::Values;
  using Place = typename Spline::Place;
  using Gradient = typename Spline::Gradient;
  using At = SectionPlace<D>;

  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  // Directions in which motors move the base.
  static constexpr Axes<XY> kAlongAxes{{1.0, 0.0}, {0.0, 1.0}};
  static constexpr Axes<XY> kAlongMotors{{1.0, 1.0}, {1.0, -1.0}};

  // A row that is watched for how well the program has foreseen it.
  struct Foreseen {
    std::size_t row = 0;
    std::size_t k = 0;
    const Shares* shares = nullptr;
    bool is_base = false;  // b̈; the nozzle's place otherwise
    XY n;
    double scale = 1.0;
    double offset = 0.0;
  };

  void build() {
    program_.reset(spline_.points().size());
    foreseen_.clear();
    fix_ends();
    const std::size_t periods = nodes_.periods();
    std::size_t next_pin = 0;
    for (std::size_t k = 0; k < periods; ++k) {
      add_period(k);
      for (; next_pin < nodes_.pins().size() && nodes_.pins()[next_pin].k == k; ++next_pin) {
        add_pin(nodes_.pins()[next_pin], pin_shares_[next_pin]);
      }
    }
    if (!is_plain_) {
      add_clock(periods - 1, at_end_, periods);
    }
    add_accel(at(periods - 1, 1.0, at_end_), true);
    for (int i = 0; i <= D; ++i) {
      program_.add_linear(Spline::kPerPoint * i + Spline::kTime, -at_node_[0][i]);
      program_.add_linear(Spline::kPerPoint * (periods - 1 + i) + Spline::kTime, at_end_[0][i]);
    }
    program_.add_damping(Tuned::kStepWeight);
  }

  // Everything about one period but its bound vertices.
  void add_period(std::size_t k) {
    if (!is_plain_) {
      add_clock(k, at_node_, k);
    }
    for (const bool is_node : {true, false}) {
      const At here = at(k, is_node ? 0.0 : 0.5, is_node ? at_node_ : at_middle_);
      add_accel(here, is_node);
      add_reach(here);
      add_contour(here, is_node);
      add_feed(here, nodes_.feed_mm_s(here.leg, k, here.x));
    }
  }

  void compare() {
    surprise_.assign(nodes_.periods(), 0.0);
    for (const Foreseen& row : foreseen_) {
      const Place at = spline_.place(row.k, *row.shares);
      const FlatOutputs<D>& flat = spline_.flat();
      const XY value = Spline::apply(row.is_base ? flat.base_accel : flat.nozzle, at);
      const double now = row.scale * dot(row.n, value) - row.offset;
      surprise_[row.k] =
          std::max(surprise_[row.k], std::abs(now - program_.value_at_solution(row.row)));
    }
  }

  [[nodiscard]] At at(std::size_t k, double x, const Shares& shares) const {
    return place_at<D>(nodes_, spline_, k, x, shares);
  }

  void add_row(const At& at, const Gradient& g, double v, double lower) {
    if (!is_plain_) {
      program_.add_row(Spline::kPerPoint * at.k, ends_.folded(at.k, g), v, lower, 1.0,
                       Tuned::kPrice);
    }
  }

  void add_square(const At& at, const Gradient& g, double v, double weight) {
    program_.add_square(Spline::kPerPoint * at.k, ends_.folded(at.k, g), v, 2.0 * weight);
  }

  void watch(const At& at, bool is_base, XY n, double scale, double offset) {
    if (!is_plain_) {
      foreseen_.push_back({program_.rows() - 1, at.k, at.shares, is_base, n, scale, offset});
    }
  }

  void fix_ends() {
    ends_.fix(is_plain_, [&](std::size_t point, int coordinate) {
      program_.fix(Spline::kPerPoint * point + coordinate);
    });
    if (!is_plain_ && section_.ends_even) {
      add_even_clock_at_end();
    }
  }

  // Time goes evenly over the last period.
  void add_even_clock_at_end() {
    const std::size_t first = Spline::kPerPoint * (nodes_.periods() - 1);
    for (int j = 1; j < D; ++j) {
      const int before = Spline::kPerPoint * j + Spline::kTime;
      const int after = before + Spline::kPerPoint;
      Gradient g = Gradient::Zero();
      g[before] = -1.0;
      g[after] = 1.0;
      const std::vector<double>& points = spline_.points();
      program_.add_square(first, g, points[first + after] - points[first + before] - 1.0,
                          Tuned::kEvenClockWeight);
    }
  }

  // The gradient of a derivative of T.
  static Gradient clock_gradient(const Shares& shares, int derivative, double scale) {
    Gradient g = Gradient::Zero();
    for (int i = 0; i <= D; ++i) {
      g[Spline::kPerPoint * i + Spline::kTime] = scale * shares[derivative][i];
    }
    return g;
  }

  // Squares of the derivatives of T, and the trust's bounds of T′.
  void add_clock(std::size_t k, const Shares& shares, std::size_t node) {
    const std::size_t first = Spline::kPerPoint * k;
    for (const int derivative : {2, 3, 4}) {
      program_.add_square(first, clock_gradient(shares, derivative, 1.0),
                          spline_.clock(k, shares, derivative),
                          2.0 * (derivative == 2 ? Tuned::kBend
                                 : D == 5        ? Tuned::kTwist
                                                 : Tuned::kTwistOfBand));
    }
    const double rate = spline_.clock(k, shares, 1);
    const double most = rounds_.trust(node) * rate;
    const double most_down =
        std::min(most, std::max(rate - Tuned::kLeastClock, Tuned::kLeastChange));
    const double most_up = rounds_.trust_to_slow(node) * rate;
    program_.add_row(first, clock_gradient(shares, 1, 1.0 / most), 0.0, -most_down / most,
                     most_up / most, Tuned::kTimesForTrust * Tuned::kPrice);
  }

  void add_accel(const At& at, bool has_square) {
    const double h = nodes_.period_s();
    const double scale = 1.0 / (rounds_.factors(at.k).accel * rules_.max_accel_mm_s2 * h * h);
    Gradient g;
    const auto add = [&](const XY& n) {
      const double v =
          spline_.linearise(at.place, *at.shares, n, spline_.flat().base_accel, scale, g);
      if (has_square) {
        add_square(at, g, v, Tuned::kAccelWeight);
      }
      add_row(at, g, v, -1.0);
      watch(at, true, n, scale, 0.0);
    };
    for_each_axis(add, rules_.shares_motors ? kAlongMotors : kAlongAxes);
  }

  // The base stays within the limits of its place.
  void add_reach(const At& at) {
    constexpr double kScale_mm = Tuned::kReachScale_mm;
    const XY base_mm = spline_.origin() + Spline::apply(spline_.flat().base, at.place);
    Gradient g;
    const auto add = [&](const XY& n, const compensate::BaseLimits& limits, double at_mm) {
      const double below_mm = at_mm - limits.min_position_mm;
      const double above_mm = limits.max_position_mm - at_mm;
      if (!is_plain_ && std::min(below_mm, above_mm) < Tuned::kNearReach_mm) {
        static_cast<void>(
            spline_.linearise(at.place, *at.shares, n, spline_.flat().base, 1.0 / kScale_mm, g));
        program_.add_row(Spline::kPerPoint * at.k, ends_.folded(at.k, g), 0.0,
                         (Tuned::kRoom_mm - below_mm) / kScale_mm,
                         (above_mm - Tuned::kRoom_mm) / kScale_mm,
                         Tuned::kTimesForReach * Tuned::kPrice);
      }
    };
    for_each_axis(add, kAlongAxes, rules_.limits, base_mm);
  }

  // n·(p − place) is not above the tolerance, also at the edges of the band. It is not below minus
  // the tolerance either, if there is a lower bound.
  void add_strip(const At& at, XY n, XY place, double tolerance_mm, bool has_square,
                 double lower = -1.0) {
    const double offset = dot(n, place - spline_.origin());
    const auto add = [&](const Axes<Values>& factors, double allowed_mm, const XY& left) {
      const double scale = 1.0 / allowed_mm;
      Gradient g;
      const double v = spline_.linearise(at.place, *at.shares, n, factors, scale, g) +
                       scale * (dot(n, left) - offset);
      if (has_square) {
        add_square(at, g, v, is_plain_ ? 1.0 : Tuned::kErrorWeight);
      }
      add_row(at, g, v, lower);
      return scale;
    };
    const double scale = add(spline_.flat().nozzle, tolerance_mm, {});
    watch(at, false, n, scale, scale * offset);
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      add(edges_.nozzle(i, spline_), edge_tolerance_mm(rules_, tolerance_mm),
          edges_.left(i, at.k, at.x));
    }
  }

  [[nodiscard]] double tolerance_mm(const At& at, std::size_t leg) const {
    return rounds_.factors(at.k).error * nodes_.tolerance_mm(leg, at.k, at.x);
  }

  void add_contour(const At& at, bool has_square) {
    const Leg& leg = section_.legs[at.leg];
    add_strip(at, turned_left(direction_of(leg)), start_of(leg), tolerance_mm(at, at.leg),
              has_square);
    add_caps(at);
  }

  // The number of tolerances beyond the end of a leg at which the nozzle is about one tolerance
  // away from the next leg.
  [[nodiscard]] double beyond(std::size_t vertex) const {
    const XY a = direction_of(section_.legs[vertex - 1]);
    const XY b = direction_of(section_.legs[vertex]);
    return dot(a, b) <= 0.0
               ? 1.0
               : Tuned::kTimesSine / std::max(std::abs(cross(a, b)), Tuned::kLeastSine);
  }

  // The nozzle does not pass the ends of a leg at vertices, where the path turns.
  void add_caps(const At& at) {
    const bool has_start = nodes_.is_near_vertex(at.leg, at.k, at.x);
    const bool has_end = nodes_.is_near_vertex(at.leg + 1, at.k, at.x);
    const XY d = direction_of(section_.legs[at.leg]);
    const XY start = start_of(section_.legs[at.leg]);
    if (has_start) {
      add_strip(at, -d, start, beyond(at.leg) * tolerance_mm(at, at.leg), false, -kInfinity);
    }
    if (has_end) {
      add_strip(at, d, start_of(section_.legs[at.leg + 1]),
                beyond(at.leg + 1) * tolerance_mm(at, at.leg), false, -kInfinity);
    }
  }

  void add_feed(const At& at, double feed_mm_s) {
    const XY velocity = Spline::apply(spline_.flat().nozzle_speed, at.place);
    const double speed = length(velocity);
    const double feed = rounds_.factors(at.k).feed * nodes_.period_s() * feed_mm_s;
    if (speed < Tuned::kNearFeed * feed) {
      return;
    }
    // The leg's direction stays from round to round. Facets around a velocity that changes would
    // leave gaps, into which the nozzle would swing from round to round.
    double direction_rad = angle_rad(velocity);
    const XY d = direction_of(section_.legs[at.leg]);
    const double along = dot(velocity, d);
    if (along > math::cos(Tuned::kFacet_rad) * speed) {
      direction_rad = angle_rad(d);
    }
    const bool is_along = along > math::cos(Tuned::kAlong_rad) * speed &&
                          !nodes_.is_near_vertex(at.leg, at.k, at.x) &&
                          !nodes_.is_near_vertex(at.leg + 1, at.k, at.x);
    Gradient g;
    for (const double facet : {0.0, -Tuned::kFacet_rad, Tuned::kFacet_rad}) {
      if (facet != 0.0 && is_along) {
        continue;
      }
      const XY n{math::cos(direction_rad + facet), math::sin(direction_rad + facet)};
      const double v =
          spline_.linearise(at.place, *at.shares, n, spline_.flat().nozzle_speed, 1.0 / feed, g);
      add_row(at, g, v, -kInfinity);
    }
  }

  // The nozzle passes a bound vertex: it is within the tolerances of both legs, and neither far
  // before the vertex nor far behind it.
  void add_pin(const SectionNodes::Pin& pin, const Shares& shares) {
    const At at{pin.k, pin.x, &shares, spline_.place(pin.k, shares), pin.vertex};
    const Leg& before = section_.legs[pin.vertex - 1];
    const Leg& after = section_.legs[pin.vertex];
    const XY a = direction_of(before);
    const XY b = direction_of(after);
    const XY corner = start_of(after);
    const double before_mm = tolerance_mm(at, pin.vertex - 1);
    const double after_mm = tolerance_mm(at, pin.vertex);
    add_strip(at, turned_left(a), corner, before_mm, true);
    add_strip(at, turned_left(b), corner, after_mm, true);
    // Where the path goes straight on or turns back, both strips are almost one. A third strip
    // crosses them. It is wide at a sharp turn, since the nozzle cuts that short by more. Where a
    // leg is gone back on itself, its end counts as any place on it.
    const bool turns_back = dot(a, b) < 0.0;
    const double times = turns_back && length(a + b) > Tuned::kAllBack ? Tuned::kTimesBack : 1.0;
    const double side = turns_back ? -1.0 : 1.0;
    const XY through = a + side * b;
    add_strip(at, through / length(through), corner, times * std::min(before_mm, after_mm), false);
    add_feed(at, std::min({before.feed_mm_s, after.feed_mm_s, after.entry_mm_s}));
  }

  const Section& section_;
  const SectionRules& rules_;
  const SectionNodes& nodes_;
  Spline& spline_;
  const EdgeNozzles<D>& edges_;
  const SectionRounds& rounds_;
  SectionEnds<D> ends_;
  Shares at_node_ = spline_shares<D>(0.0);
  Shares at_middle_ = spline_shares<D>(0.5);
  Shares at_end_ = spline_shares<D>(1.0);
  std::vector<Shares> pin_shares_;

  bool is_plain_ = false;
  std::vector<double> surprise_;
  std::vector<Foreseen> foreseen_;
  quadratic::ElasticProgram<Spline::kWidth> program_;
};

}  // namespace unflex::timing
