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
// Method: sequential quadratic programs. Each is linear in the steps of the control points, and
// trusts them only as far as T′ changes by a share that grows where the last step came out as
// foreseen, and shrinks where it did not.
//
// The path in time is the same however u is spread over it, so the squares of T‴ and T⁗ keep nodes
// evenly spread.
#include "section_motion.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "bounded_plan.hpp"
#include "edge_nozzles.hpp"
#include "section_nodes.hpp"
#include "section_rounds.hpp"
#include "section_spline.hpp"
#include "unflex/core/math.hpp"
#include "unflex/quadratic/elastic_program.hpp"

namespace unflex::timing {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// ωh. The matrix for z is too badly conditioned below 0.4.
constexpr double kNodePeriod = 0.45;
constexpr int kRounds = 18;
// Weights of the squares.
constexpr double kBend = 1.0;     // r₂
constexpr double kTwist = 300.0;  // r₃
constexpr double kTwistOfBand = 1000.0;
constexpr double kOfError = 4e-3;
constexpr double kOfAccel = 1e-2;
constexpr double kOfStep = 1e-6;
constexpr double kOfEvenClock = 1e5;
// ρ: cost, in node periods, of exceeding a bound by 100 %.
constexpr double kPrice = 30.0;
constexpr double kTimesForTrust = 100.0;
// T′ at least.
constexpr double kLeastClock = 0.3;
// Nodes below this share of F have no row for it.
constexpr double kNearFeed = 0.3;
// Directions in which motors move the base.
constexpr Axes<XY> kAlongAxes{{1.0, 0.0}, {0.0, 1.0}};
constexpr Axes<XY> kAlongMotors{{1.0, 1.0}, {1.0, -1.0}};
constexpr double kFacet_rad = 0.3;
constexpr double kAlong_rad = 0.1;
// The last periods of a section, in which its end gives the base and its clock.
constexpr std::size_t kGivenPeriods = 3;
// The gap per unknown at which a program counts as solved: very rough as long as much is broken,
// and rough as long as the next program is another one.
constexpr double kFirstGap = 0.05;
constexpr double kRoughGap = 1e-3;
constexpr double kRoughGapOfBand = 1e-2;
constexpr double kFineGap = 1e-4;
constexpr int kFineRounds = 2;
// The base keeps so far away from the limits of its place.
constexpr double kRoom_mm = 3e-3;
// Travel beside filament has the tolerance of filament for so many node periods in the end, and for
// more (SectionNodes::kBeside) in rows, as these look less often.
constexpr double kBesideInTheEnd = 2.0;
// A round that gains less settles the search, and so do several without a gain.
constexpr double kGain = 1e-3;
constexpr int kIdleRounds = 2;

template <int D>
class Program {
 public:
  using Spline = SectionSpline<D>;
  using Shares = typename Spline::Shares;
  using Values = typename Spline::Values;
  using Place = typename Spline::Place;
  using Rows = quadratic::ElasticProgram<Spline::kWidth>;
  using Gradient = typename Spline::Gradient;

  Program(const Section& section, const SectionRules& rules)
      : section_(section),
        legs_(section.legs),
        rules_(rules),
        nodes_(
            section,
            kNodePeriod /
                most_of_axes([](const dynamics::Mode& mode) { return mode.omega_rad_s; }, rules)),
        spline_(section, rules, nodes_),
        edges_(section, rules),
        rounds_(nodes_.periods(), D != 5) {
    for (const SectionNodes::Pin& pin : nodes_.pins()) {
      pin_shares_.push_back(spline_shares<D>(pin.x));
    }
    set_jump();
  }

  // False: nothing was found that keeps the rules.
  [[nodiscard]] bool solve() {
    // The matrix is badly conditioned, so what is left of the residual is solved for again.
    for (int i = 0; i < 3; ++i) {
      if (!step(true)) {
        return false;
      }
    }
    double last = duration();
    double least = kInfinity;
    double least_before = kInfinity;  // when it was last better by a gain
    int idle_rounds = 0;
    std::vector<double> best;
    for (int round = 0; round < kRounds; ++round) {
      if (!step(false)) {
        return false;
      }
      measure();
      const double gain = last - duration();
      last = duration();
      bool is_settled = false;
      if (rounds_.is_kept() && last < least) {
        least = last;
        best = spline_.points();
        is_settled = gain < kGain * last;
      }
      if (least < (1.0 - kGain) * least_before) {
        least_before = least;
        idle_rounds = 0;
      } else if (!best.empty()) {
        is_settled = is_settled || ++idle_rounds >= kIdleRounds;
      }
      if (fine_rounds_ > 0 && (is_settled || fine_rounds_ == kFineRounds)) {
        break;
      }
      fine_rounds_ += is_settled || fine_rounds_ > 0 ? 1 : 0;
      if (rounds_.is_stuck(round)) {
        break;
      }
      rounds_.adapt(surprise_, round);
    }
    if (best.empty()) {
      return false;
    }
    spline_.points() = std::move(best);
    edges_.follow(spline_);
    return true;
  }

  [[nodiscard]] const Spline& spline() const { return spline_; }
  [[nodiscard]] const SectionNodes& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<dynamics::NozzleXY>& edge_nozzles() const {
    return edges_.ends();
  }

 private:
  // In node periods.
  [[nodiscard]] double duration() const {
    return spline_.clock(nodes_.periods() - 1, at_end_) - spline_.clock(0, at_node_);
  }

  // Where the base rests at an end, b̈ may jump there, and nothing below it. So the D control points
  // of that end have one freedom per axis, in these shares.
  void set_jump() {
    const Eigen::Matrix<double, D, 1> shares =
        Spline::end_matrix().fullPivLu().solve(Eigen::Matrix<double, D, 1>::Unit(D - 1));
    for (int j = 0; j < D; ++j) {
      jump_[j] = shares[j];
    }
  }
  [[nodiscard]] bool jumps_at_start() const { return !section_.starts_even && !section_.nozzle; }
  [[nodiscard]] bool jumps_at_end() const { return !section_.ends_even; }

  // The last point of the beginning, and the first one of the end, stand for the others there.
  Gradient folded(std::size_t k, const Gradient& g) const {
    Gradient result = g;
    const auto fold = [&](std::size_t point, std::size_t onto, double share) {
      for (const int axis : {0, 1}) {
        double& own = result[static_cast<long>(Spline::kPerPoint * (point - k)) + axis];
        result[static_cast<long>(Spline::kPerPoint * (onto - k)) + axis] += share * own;
        own = 0.0;
      }
    };
    for (std::size_t j = k; jumps_at_start() && j + 1 < D; ++j) {
      fold(j, D - 1, jump_[j] / jump_[D - 1]);
    }
    for (std::size_t j = 1; jumps_at_end() && nodes_.periods() + j <= k + D; ++j) {
      fold(nodes_.periods() + j, nodes_.periods(), jump_[j] / jump_[0]);
    }
    return result;
  }

  // Takes the step of the control points.
  void take(std::span<const double> step) {
    std::vector<double>& points = spline_.points();
    for (std::size_t i = 0; i < points.size(); ++i) {
      points[i] += step[i];
    }
    const std::size_t end = Spline::kPerPoint * nodes_.periods();
    for (const int axis : {0, 1}) {
      for (int j = 0; jumps_at_start() && j + 1 < D; ++j) {
        points[Spline::kPerPoint * j + axis] +=
            jump_[j] / jump_[D - 1] * step[Spline::kPerPoint * (D - 1) + axis];
      }
      for (int j = 1; jumps_at_end() && j < D; ++j) {
        points[end + Spline::kPerPoint * j + axis] += jump_[j] / jump_[0] * step[end + axis];
      }
    }
  }

  // A row, so that it can be seen how well the program has foreseen it.
  struct Foreseen {
    std::size_t row = 0;
    std::size_t k = 0;
    const Shares* shares = nullptr;
    bool is_base = false;  // b̈; the nozzle's place otherwise
    XY n;
    double scale = 1.0;
    double offset = 0.0;
  };

  // By how much the last step has come out otherwise than foreseen, per period.
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

  // What rows are about: u, and what is there.
  struct At {
    std::size_t k = 0;
    double x = 0.0;
    const Shares* shares = nullptr;
    Place place;
    std::size_t leg = 0;
  };

  [[nodiscard]] At at(std::size_t k, double x, const Shares& shares) const {
    At result{k, x, &shares, spline_.place(k, shares)};
    result.leg = nodes_.nearest_leg(k, x, spline_.nozzle_mm(result.place));
    return result;
  }

  void add_row(const At& at, const Gradient& g, double v, double lower) {
    if (!is_plain_) {
      program_.add_row(Spline::kPerPoint * at.k, folded(at.k, g), v, lower, 1.0, kPrice);
    }
  }

  void add_square(const At& at, const Gradient& g, double v, double weight) {
    program_.add_square(Spline::kPerPoint * at.k, folded(at.k, g), v, 2.0 * weight);
  }

  void watch(const At& at, bool is_base, XY n, double scale, double offset) {
    if (!is_plain_) {
      foreseen_.push_back({program_.rows() - 1, at.k, at.shares, is_base, n, scale, offset});
    }
  }

  void fix_ends() {
    const std::size_t periods = nodes_.periods();
    const auto fix = [&](std::size_t point, int coordinate) {
      program_.fix(Spline::kPerPoint * point + coordinate);
    };
    for (int j = 0; j < D; ++j) {
      for (const int axis : {0, 1}) {
        if (j + 1 < D || !jumps_at_start()) {
          fix(j, axis);
        }
        if (j > 0 || !jumps_at_end()) {
          fix(periods + j, axis);
        }
      }
    }
    const std::size_t fixed_times =
        is_plain_ ? periods + D : (section_.starts_even || section_.nozzle ? D : 1);
    for (std::size_t j = 0; j < fixed_times; ++j) {
      fix(j, Spline::kTime);
    }
    if (is_plain_ || !section_.ends_even) {
      return;
    }
    // Time goes evenly over the last period.
    const std::size_t first = Spline::kPerPoint * (periods - 1);
    for (int j = 1; j < D; ++j) {
      const int before = Spline::kPerPoint * j + Spline::kTime;
      const int after = before + Spline::kPerPoint;
      Gradient g = Gradient::Zero();
      g[before] = -1.0;
      g[after] = 1.0;
      const std::vector<double>& points = spline_.points();
      program_.add_square(first, g, points[first + after] - points[first + before] - 1.0,
                          kOfEvenClock);
    }
  }

  // The gradient of a derivative of T.
  static Gradient of_clock(const Shares& shares, int derivative, double scale) {
    Gradient g = Gradient::Zero();
    for (int i = 0; i <= D; ++i) {
      g[Spline::kPerPoint * i + Spline::kTime] = scale * shares[derivative][i];
    }
    return g;
  }

  void add_clock(std::size_t k, const Shares& shares, std::size_t node) {
    const std::size_t first = Spline::kPerPoint * k;
    for (const int derivative : {2, 3, 4}) {
      program_.add_square(first, of_clock(shares, derivative, 1.0),
                          spline_.clock(k, shares, derivative),
                          2.0 * (derivative == 2 ? kBend
                                 : D == 5        ? kTwist
                                                 : kTwistOfBand));
    }
    constexpr double kLeastChange = 1e-3;
    const double rate = spline_.clock(k, shares, 1);
    const double most = rounds_.trust(node) * rate;
    const double most_down = std::min(most, std::max(rate - kLeastClock, kLeastChange));
    const double most_up = rounds_.trust_to_slow(node) * rate;
    program_.add_row(first, of_clock(shares, 1, 1.0 / most), 0.0, -most_down / most, most_up / most,
                     kTimesForTrust * kPrice);
  }

  void add_accel(const At& at, bool has_square) {
    const double h = nodes_.period_s();
    const double scale = 1.0 / (rounds_.factors(at.k).accel * rules_.max_accel_mm_s2 * h * h);
    Gradient g;
    const auto add = [&](const XY& n) {
      const double v =
          spline_.linearise(at.place, *at.shares, n, spline_.flat().base_accel, scale, g);
      if (has_square) {
        add_square(at, g, v, kOfAccel);
      }
      add_row(at, g, v, -1.0);
      watch(at, true, n, scale, 0.0);
    };
    for_each_axis(add, rules_.shares_motors ? kAlongMotors : kAlongAxes);
  }

  // The base stays where it may be.
  void add_reach(const At& at) {
    constexpr double kNear_mm = 1.0;
    constexpr double kScale_mm = 0.02;
    constexpr double kTimesForReach = 3.0;
    const XY base_mm = spline_.origin() + Spline::apply(spline_.flat().base, at.place);
    Gradient g;
    const auto add = [&](const XY& n, const compensate::BaseLimits& limits, double at_mm) {
      const double below_mm = at_mm - limits.min_position_mm;
      const double above_mm = limits.max_position_mm - at_mm;
      if (!is_plain_ && std::min(below_mm, above_mm) < kNear_mm) {
        static_cast<void>(
            spline_.linearise(at.place, *at.shares, n, spline_.flat().base, 1.0 / kScale_mm, g));
        program_.add_row(Spline::kPerPoint * at.k, folded(at.k, g), 0.0,
                         (kRoom_mm - below_mm) / kScale_mm, (above_mm - kRoom_mm) / kScale_mm,
                         kTimesForReach * kPrice);
      }
    };
    for_each_axis(add, kAlongAxes, rules_.limits, base_mm);
  }

  // n·(p − place) is not above the tolerance, also at the edges of the band; nor below minus the
  // tolerance, if there is a lower bound.
  void add_strip(const At& at, XY n, XY place, double tolerance_mm, bool has_square,
                 double lower = -1.0) {
    const double offset = dot(n, place - spline_.origin());
    const auto add = [&](const Axes<Values>& of, double allowed_mm, const XY& left) {
      const double scale = 1.0 / allowed_mm;
      Gradient g;
      const double v = spline_.linearise(at.place, *at.shares, n, of, scale, g) +
                       scale * (dot(n, left) - offset);
      if (has_square) {
        add_square(at, g, v, is_plain_ ? 1.0 : kOfError);
      }
      add_row(at, g, v, lower);
      return scale;
    };
    const double scale = add(spline_.flat().nozzle, tolerance_mm, {});
    watch(at, false, n, scale, scale * offset);
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      add(edges_.nozzle(i, spline_), at_edge_mm(tolerance_mm), edges_.left(i, at.k, at.x));
    }
  }

  // How far the nozzles at the edges may stray.
  [[nodiscard]] double at_edge_mm(double tolerance_mm) const {
    return std::min(rules_.times_tolerance * tolerance_mm, kTravelTolerance_mm);
  }

  [[nodiscard]] double tolerance_mm(const At& at, std::size_t leg) const {
    return rounds_.factors(at.k).error * nodes_.tolerance_mm(leg, at.k, at.x);
  }

  void add_contour(const At& at, bool has_square) {
    const XY d = direction_of(legs_[at.leg]);
    add_strip(at, turned_left(d), start_of(legs_[at.leg]), tolerance_mm(at, at.leg), has_square);
    add_caps(at);
  }

  // How many tolerances beyond the end of a leg the nozzle is about one tolerance away from the
  // next.
  [[nodiscard]] double beyond(std::size_t vertex) const {
    constexpr double kLeastSine = 0.1;
    constexpr double kTimesSine = 2.0;
    const XY a = direction_of(legs_[vertex - 1]);
    const XY b = direction_of(legs_[vertex]);
    return dot(a, b) <= 0.0 ? 1.0 : kTimesSine / std::max(std::abs(cross(a, b)), kLeastSine);
  }

  // The nozzle does not pass the ends of a leg at vertices, where the path turns.
  void add_caps(const At& at) {
    const bool has_start = nodes_.is_near_vertex(at.leg, at.k, at.x);
    const bool has_end = nodes_.is_near_vertex(at.leg + 1, at.k, at.x);
    const XY d = direction_of(legs_[at.leg]);
    const XY start = start_of(legs_[at.leg]);
    if (has_start) {
      add_strip(at, -d, start, beyond(at.leg) * tolerance_mm(at, at.leg), false, -kInfinity);
    }
    if (has_end) {
      add_strip(at, d, start_of(legs_[at.leg + 1]), beyond(at.leg + 1) * tolerance_mm(at, at.leg),
                false, -kInfinity);
    }
  }

  void add_feed(const At& at, double feed_mm_s) {
    const XY velocity = Spline::apply(spline_.flat().nozzle_speed, at.place);
    const double speed = length(velocity);
    const double feed = rounds_.factors(at.k).feed * nodes_.period_s() * feed_mm_s;
    if (speed < kNearFeed * feed) {
      return;
    }
    // A direction that stays from round to round: around one that does not, the nozzle would swing
    // from round to round to where no facet is near.
    double direction_rad = angle_rad(velocity);
    const XY d = direction_of(legs_[at.leg]);
    const double along = dot(velocity, d);
    if (along > math::cos(kFacet_rad) * speed) {
      direction_rad = angle_rad(d);
    }
    // One facet is enough there.
    const bool is_along = along > math::cos(kAlong_rad) * speed &&
                          !nodes_.is_near_vertex(at.leg, at.k, at.x) &&
                          !nodes_.is_near_vertex(at.leg + 1, at.k, at.x);
    Gradient g;
    for (const double facet : {0.0, -kFacet_rad, kFacet_rad}) {
      if (facet != 0.0 && is_along) {
        continue;
      }
      const XY n{math::cos(direction_rad + facet), math::sin(direction_rad + facet)};
      const double v =
          spline_.linearise(at.place, *at.shares, n, spline_.flat().nozzle_speed, 1.0 / feed, g);
      add_row(at, g, v, -kInfinity);
    }
  }

  // The nozzle passes a bound vertex: it is within the tolerances of both legs, and not yet or no
  // longer far along them.
  void add_pin(const SectionNodes::Pin& pin, const Shares& shares) {
    const At at{pin.k, pin.x, &shares, spline_.place(pin.k, shares), pin.vertex};
    const Leg& before = legs_[pin.vertex - 1];
    const Leg& after = legs_[pin.vertex];
    const XY a = direction_of(before);
    const XY b = direction_of(after);
    const XY corner = start_of(after);
    const double of_before = tolerance_mm(at, pin.vertex - 1);
    const double of_after = tolerance_mm(at, pin.vertex);
    add_strip(at, turned_left(a), corner, of_before, true);
    add_strip(at, turned_left(b), corner, of_after, true);
    // Where the path goes straight on or turns back, both strips are almost one. A third one
    // crosses them, which is wide where a turn is sharp, since the nozzle cuts that short by more.
    // Where all of a leg is gone back, its end counts as any place on it.
    constexpr double kTimesBack = 3.0;
    constexpr double kAllBack = 1e-6;
    const bool turns_back = dot(a, b) < 0.0;
    const double times = turns_back && length(a + b) > kAllBack ? kTimesBack : 1.0;
    const double side = turns_back ? -1.0 : 1.0;
    const XY through = a + side * b;
    add_strip(at, through / length(through), corner, times * std::min(of_before, of_after), false);
    add_feed(at, std::min({before.feed_mm_s, after.feed_mm_s, after.entry_mm_s}));
  }

  // The gap at which the next program counts as solved.
  [[nodiscard]] double gap() const {
    if (is_plain_ || fine_rounds_ > 0) {
      return kFineGap;
    }
    if (rounds_.is_far()) {
      return kFirstGap;
    }
    return D == 5 ? kRoughGap : kRoughGapOfBand;
  }

  // One program: least squares in the timing as it is, or the next step of all.
  [[nodiscard]] bool step(bool is_plain) {
    is_plain_ = is_plain;
    program_.reset(spline_.points().size());
    foreseen_.clear();
    fix_ends();
    const std::size_t periods = nodes_.periods();
    std::size_t next_pin = 0;
    for (std::size_t k = 0; k < periods; ++k) {
      if (!is_plain) {
        add_clock(k, at_node_, k);
      }
      for (const bool is_node : {true, false}) {
        const At here = at(k, is_node ? 0.0 : 0.5, is_node ? at_node_ : at_middle_);
        add_accel(here, is_node);
        add_reach(here);
        add_contour(here, is_node);
        add_feed(here, nodes_.feed_mm_s(here.leg, k, here.x));
      }
      for (; next_pin < nodes_.pins().size() && nodes_.pins()[next_pin].k == k; ++next_pin) {
        add_pin(nodes_.pins()[next_pin], pin_shares_[next_pin]);
      }
    }
    if (!is_plain) {
      add_clock(periods - 1, at_end_, periods);
    }
    add_accel(at(periods - 1, 1.0, at_end_), true);
    for (int i = 0; i <= D; ++i) {
      program_.add_linear(Spline::kPerPoint * i + Spline::kTime, -at_node_[0][i]);
      program_.add_linear(Spline::kPerPoint * (periods - 1 + i) + Spline::kTime, at_end_[0][i]);
    }
    program_.add_damping(kOfStep);
    const std::optional<std::span<const double>> step = program_.solve(gap(), iterations_);
    if (!step) {
      return false;
    }
    take(*step);
    compare();
    edges_.follow(spline_);
    return true;
  }

  // Looks also between the places that rows are for.
  void measure() {
    std::vector<Excess> excess(nodes_.periods());
    const double h = nodes_.period_s();
    for (std::size_t k = 0; k < nodes_.periods(); ++k) {
      for (int look = 0; look < kLooks + (k + 1 == nodes_.periods() ? 1 : 0); ++look) {
        const At here = at(k, static_cast<double>(look) / kLooks, kSharesAtLooks<D>[look]);
        const FlatOutputs<D>& flat = spline_.flat();
        const double a =
            asked_of_motors(Spline::apply(flat.base_accel, here.place), rules_.shares_motors);
        const XY velocity = Spline::apply(flat.nozzle_speed, here.place);
        excess[k].include({a / (rules_.max_accel_mm_s2 * h * h), error(here),
                           length(velocity) / (h * legs_[here.leg].feed_mm_s)});
      }
    }
    const double of_end = excess_at_end(excess);
    rounds_.show(std::move(excess), of_end);
  }

  // e relative to the tolerance, the largest of the axes as given and at the edges of the band.
  [[nodiscard]] double error(const At& at) const {
    const XY p = spline_.nozzle_mm(at.place);
    const double tolerance = nodes_.tolerance_mm(at.leg, at.k, at.x, kBesideInTheEnd);
    double e = nodes_.error_mm(at.k, at.x, p) / tolerance;
    for (std::size_t i = 0; i < edges_.size(); ++i) {
      const XY of_edge = Spline::apply(edges_.nozzle(i, spline_), at.place);
      const double at_edge =
          nodes_.error_mm(at.k, at.x, spline_.origin() + of_edge + edges_.left(i, at.k, at.x));
      e = std::max(e, at_edge / at_edge_mm(tolerance));
    }
    return e;
  }

  // How far the nozzles at the edges of a band stray where the base and its clock are given, and
  // how far they swing after it, relative to what they may.
  [[nodiscard]] double excess_at_end(const std::vector<Excess>& of_periods) const {
    if (edges_.size() == 0) {
      return 0.0;
    }
    double excess = 0.0;
    for (std::size_t k = nodes_.periods() - kGivenPeriods; k < nodes_.periods(); ++k) {
      excess = std::max(excess, of_periods[k].error);
    }
    if (section_.swing_tolerance_mm) {
      const Place end = spline_.place(nodes_.periods() - 1, at_end_);
      const XY base_mm = spline_.origin() + Spline::apply(spline_.flat().base, end);
      excess = std::max(excess, edges_.largest_swing_mm(base_mm) / *section_.swing_tolerance_mm);
    }
    return excess;
  }

  const Section& section_;
  const std::vector<Leg>& legs_;
  SectionRules rules_;
  SectionNodes nodes_;
  Spline spline_;
  EdgeNozzles<D> edges_;
  Shares at_node_ = spline_shares<D>(0.0);
  Shares at_middle_ = spline_shares<D>(0.5);
  Shares at_end_ = spline_shares<D>(1.0);
  Values jump_{};
  std::vector<Shares> pin_shares_;

  SectionRounds rounds_;
  std::vector<double> surprise_;  // of the last step, per period
  std::vector<Foreseen> foreseen_;
  bool is_plain_ = false;
  int fine_rounds_ = 0;
  int iterations_ = 0;
  Rows program_;
};

template <int D>
class SplineMotion : public SectionMotion {
 public:
  explicit SplineMotion(const Program<D>& program)
      : spline_(program.spline()), nodes_(program.nodes()), edge_nozzles_(program.edge_nozzles()) {
    for (std::size_t k = 0; k < spline_.periods(); ++k) {
      times_.push_back(clock(k, 0.0));
    }
    times_.push_back(clock(spline_.periods() - 1, 1.0));
  }

  [[nodiscard]] double duration_s() const override {
    return (times_.back() - times_.front()) * spline_.period_s();
  }

  [[nodiscard]] Base base(double t) const override {
    const double wanted =
        std::clamp(times_.front() + t / spline_.period_s(), times_.front(), times_.back());
    const auto next = std::upper_bound(times_.begin() + 1, times_.end() - 1, wanted);
    const auto k = static_cast<std::size_t>(next - times_.begin()) - 1;
    constexpr int kNewtonSteps = 4;
    double x = (wanted - times_[k]) / (times_[k + 1] - times_[k]);
    SplineShares<D> shares = spline_shares<D>(x);
    for (int i = 0; i < kNewtonSteps; ++i) {
      const double late = spline_.clock(k, shares) - wanted;
      const double nearer = std::clamp(x - late / spline_.clock(k, shares, 1), 0.0, 1.0);
      if (nearer == x) {
        break;
      }
      x = nearer;
      shares = spline_shares<D>(x);
    }
    using Spline = SectionSpline<D>;
    const auto at = spline_.place(k, shares);
    return map_axes(
        [](double place_mm, double speed_mm_s) {
          return OfAxis{place_mm, speed_mm_s};
        },
        spline_.origin() + Spline::apply(spline_.flat().base, at),
        Spline::apply(spline_.flat().base_speed, at) / spline_.period_s());
  }

  [[nodiscard]] std::vector<dynamics::NozzleXY> edge_nozzles() const override {
    return edge_nozzles_;
  }

  [[nodiscard]] std::vector<Passage> passages() const override {
    std::vector<Passage> result;
    const auto add = [&](std::size_t k, double x) {
      const XY p = spline_.nozzle_mm(spline_.place(k, spline_shares<D>(x)));
      const std::size_t leg = nodes_.nearest_leg(k, x, p);
      result.push_back(
          {(clock(k, x) - times_.front()) * spline_.period_s(), leg, nodes_.along_mm(leg, p)});
    };
    for (std::size_t k = 0; k < spline_.periods(); ++k) {
      add(k, 0.0);
      add(k, 0.5);
    }
    add(spline_.periods() - 1, 1.0);
    return result;
  }

 private:
  [[nodiscard]] double clock(std::size_t k, double x) const {
    return spline_.clock(k, spline_shares<D>(x));
  }

  SectionSpline<D> spline_;
  SectionNodes nodes_;
  std::vector<dynamics::NozzleXY> edge_nozzles_;
  std::vector<double> times_;  // T at the nodes
};

template <int D>
std::unique_ptr<SectionMotion> motion(const Section& section, const SectionRules& rules) {
  Program<D> program(section, rules);
  return program.solve() ? std::make_unique<SplineMotion<D>>(program) : nullptr;
}

}  // namespace

std::unique_ptr<SectionMotion> fastest_motion(const Section& section, const SectionRules& rules) {
  return !rules.edges.empty() ? motion<7>(section, rules) : motion<5>(section, rules);
}

}  // namespace unflex::timing
