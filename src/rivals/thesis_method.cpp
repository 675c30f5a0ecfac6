// The equations form a chain: those of interval k contain the base's position b_k and three
// velocities. So least squares need no large matrix. From the end of the plan on, v_{k+1} is
// eliminated by an orthogonal transformation of the rows that contain it (G. H. Golub & C. F. Van
// Loan, "Matrix Computations", 4th ed., section 5.3). This leaves rows in (b_k, v_{k−1}, v_k)
// alone, and in the end none, because v_0 = v_{−1} = 0.
//
// The jerk rows make the sum of squares a convex function that is quadratic piece by piece: a row
// is zero, or it is affine where the jerk is beyond a limit. The least point is found by a
// primal-dual interior point (S. J. Wright, "Primal-Dual Interior-Point Methods", SIAM 1997,
// chapters 1 and 5). With W the row's weight and the jerk j in units of its limit, there are for
// either side of a row
//
//   u      j − 1 or −j − 1
//   s      how far j is beyond the limit, s ≥ 0; W²s is the limit's multiplier
//   t      s − u, t ≥ 0, how far j is within it
//   μ      s t, to be 0; a step aims at less than its present mean
//   c, d   (μ − s t)/d, s + t
//
// Linearised, Δs = c + (s/d) Δu and Δt = c − (t/d) Δu. So a step is a least-squares problem of the
// defects and of one row for each jerk. With the sides 1 and 2 its weight is W √(s₁/d₁ + s₂/d₂),
// and it wants the jerk j − (s₁ + c₁ − s₂ − c₂)/(s₁/d₁ + s₂/d₂).
//
// When a step changes no side, the rows with s > t are taken as active. The least-squares point
// of the defects and these rows is the least point of the whole sum if it keeps every row on its
// side, because the sum is convex and its gradient is zero there.
#include "unflex/rivals/thesis_method.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace unflex::rivals {
namespace {

// In units of its limit, a jerk may lie by this much on the wrong side, which is rounding.
constexpr double kSideTolerance = 1e-9;
// A step of the interior point aims at this share of the present mean of s t.
constexpr double kCentring = 0.02;
// A step goes this share of the way on which all s and t stay positive.
constexpr double kToBoundary = 0.99;

// A linear form in v_{k+1}, b_k, v_{k−1}, v_k and 1.
using Form = Eigen::Matrix<double, 1, 5>;
enum FormPart : int { kNext = 0, kBase, kBefore, kNow, kConstant };

Form unit(FormPart part) { return Form::Unit(part); }

struct Nodes {
  double h;
  std::vector<dynamics::NozzleMotion> nozzle;

  [[nodiscard]] std::size_t count() const { return nozzle.size(); }
};

Nodes sample(const AxisPath& reference, double period_s) {
  Nodes nodes{period_s, {}};
  const auto intervals = static_cast<std::size_t>(std::ceil(end_s(reference) / period_s - 1e-9));
  PathCursor cursor(reference);
  for (std::size_t k = 0; k <= intervals; ++k) {
    nodes.nozzle.push_back(cursor.at(static_cast<double>(k) * period_s));
  }
  return nodes;
}

struct Defects {
  Form position;
  Form velocity;
};

// The defects of the interval that begins at node k.
Defects defects(const Nodes& nodes, const dynamics::FlexibleAxis& axis, std::size_t k) {
  const dynamics::NozzleMotion& p1 = nodes.nozzle[k];
  const dynamics::NozzleMotion& p2 = nodes.nozzle[k + 1];
  const double h = nodes.h;
  const double stiffness = axis.main_rad_s() * axis.main_rad_s();
  const double damping = 2.0 * axis.main_damping_ratio() * axis.main_rad_s();
  const Form one = unit(kConstant);
  const Form base1 = unit(kBase);
  const Form base2 = base1 + 0.5 * h * (unit(kNow) + unit(kNext));
  const auto force = [&](const Form& base, const Form& rate, double p, double p_rate) -> Form {
    return stiffness * (base - p * one) + damping * (rate - p_rate * one);
  };
  const Form f1 = force(base1, unit(kNow), p1.position, p1.velocity);
  const Form f2 = force(base2, unit(kNext), p2.position, p2.velocity);

  const double slope = -1.5 * (p1.position - p2.position) / h;
  const double slope_rate = -1.5 * (p1.velocity - p2.velocity) / h;
  const double sum_rate = p1.velocity + p2.velocity;
  const double middle = 0.5 * (p1.position + p2.position) + h / 8.0 * (p1.velocity - p2.velocity);
  const Form middle_rate = 0.5 * sum_rate * one + h / 8.0 * (f1 - f2);
  const Form f_middle = stiffness * (0.5 * (base1 + base2) - middle * one) +
                        damping * (0.5 * (unit(kNow) + unit(kNext)) - middle_rate);
  return {(slope - 0.25 * sum_rate) * one - middle_rate,
          slope_rate * one - 0.25 * (f1 + f2) - f_middle};
}

// The base at the nodes.
struct Base {
  std::vector<double> position;
  std::vector<double> velocity;

  // The value of a form of the interval that begins at node k.
  [[nodiscard]] double value(const Form& form, std::size_t k) const {
    return rest(form, k) + form(kNext) * velocity[k + 1];
  }
  // The value without v_{k+1}.
  [[nodiscard]] double rest(const Form& form, std::size_t k) const {
    return form(kBase) * position[k] + form(kBefore) * (k > 0 ? velocity[k - 1] : 0.0) +
           form(kNow) * velocity[k] + form(kConstant);
  }
  // Goes a share of the way to another base.
  void go(double share, const Base& to) {
    for (std::size_t k = 0; k < velocity.size(); ++k) {
      position[k] += share * (to.position[k] - position[k]);
      velocity[k] += share * (to.velocity[k] - velocity[k]);
    }
  }
};

// Solves each form, which is to be zero, for v_{k+1}, starting from the base at rest at the plan's
// begin.
Base substitute(const Nodes& nodes, const std::vector<Form>& forms) {
  Base base{{nodes.nozzle.front().position}, {0.0}};
  for (std::size_t k = 0; k < forms.size(); ++k) {
    base.velocity.push_back(-base.rest(forms[k], k) / forms[k](kNext));
    base.position.push_back(base.position[k] +
                            0.5 * nodes.h * (base.velocity[k] + base.velocity[k + 1]));
  }
  return base;
}

// The path of parabolas from node to node.
AxisPath path_of(const Nodes& nodes, const Base& base) {
  AxisPath path;
  for (std::size_t k = 0; k + 1 < nodes.count(); ++k) {
    path.push_back({static_cast<double>(k) * nodes.h,
                    {base.position[k], base.velocity[k],
                     (base.velocity[k + 1] - base.velocity[k]) / nodes.h}});
  }
  path.push_back(
      {static_cast<double>(nodes.count() - 1) * nodes.h, {base.position.back(), 0.0, 0.0}});
  return path;
}

// The rows weight · (jerk − wanted).
struct JerkRows {
  Eigen::ArrayXd weight;
  Eigen::ArrayXd wanted;
};

// The limit of all jerks on one side.
struct Limit {
  double sign;  // u = sign · jerk − 1
  Eigen::ArrayXd s;
  Eigen::ArrayXd t;

  // Begins with the same product s t everywhere, that of the largest jerk's size.
  Limit(double side, const Eigen::ArrayXd& jerk) : sign(side) {
    const double product = jerk.square().maxCoeff();
    const Eigen::ArrayXd u = sign * jerk - 1.0;
    const Eigen::ArrayXd larger = 0.5 * (u.abs() + (u.square() + 4.0 * product).sqrt());
    s = (u > 0.0).select(larger, product / larger);
    t = (u > 0.0).select(product / larger, larger);
  }

  [[nodiscard]] Eigen::ArrayXd share() const { return s / (s + t); }
  [[nodiscard]] Eigen::ArrayXd centring(double aim) const { return (aim - s * t) / (s + t); }
  [[nodiscard]] Eigen::ArrayXd change_of_s(double aim, const Eigen::ArrayXd& jerk_change) const {
    return centring(aim) + sign * share() * jerk_change;
  }
  [[nodiscard]] Eigen::ArrayXd change_of_t(double aim, const Eigen::ArrayXd& jerk_change) const {
    return centring(aim) - sign * t / (s + t) * jerk_change;
  }
};

// The largest share of the change that leaves no value negative.
double way_to_boundary(const Eigen::ArrayXd& values, const Eigen::ArrayXd& change) {
  const double fastest = (-change / values).maxCoeff();
  return fastest > 0.0 ? 1.0 / fastest : std::numeric_limits<double>::infinity();
}

class LeastSquares {
 public:
  LeastSquares(const Nodes& nodes, const dynamics::FlexibleAxis& axis, double max_accel)
      : nodes_(nodes),
        weight_(kJerkWeight * max_accel / nodes.h),
        jerk_((unit(kBefore) - 2.0 * unit(kNow) + unit(kNext)) / (nodes.h * max_accel)) {
    for (std::size_t k = 0; k + 1 < nodes_.count(); ++k) {
      defects_.push_back(defects(nodes_, axis, k));
    }
  }

  // How many least-squares problems solve() has solved.
  [[nodiscard]] int iterations() const { return iterations_; }

  [[nodiscard]] Base solve() {
    Eigen::ArrayXd sides = Eigen::ArrayXd::Zero(static_cast<Eigen::Index>(defects_.size()));
    Base base = least_point(active(sides));
    if (keeps(sides, base)) {
      return base;
    }
    // Rows that want no jerk at all leave jerks that are not far beyond the limits.
    base = least_point({Eigen::ArrayXd::Constant(sides.size(), weight_), sides});
    Eigen::ArrayXd jerk = jerks(base);
    Limit upper(1.0, jerk);
    Limit lower(-1.0, jerk);
    double gradient = 1.0;  // as a share of the first
    while (true) {
      const double product = 0.5 * (upper.s * upper.t + lower.s * lower.t).mean();
      if (std::max(std::sqrt(product), gradient) <= kSideTolerance) {
        return base;
      }
      const double aim = kCentring * product;
      const Eigen::ArrayXd share = upper.share() + lower.share();
      const Eigen::ArrayXd force = upper.s + upper.centring(aim) - lower.s - lower.centring(aim);
      const Base next = least_point({weight_ * share.sqrt(), jerk - force / share});
      const Eigen::ArrayXd change = jerks(next) - jerk;
      double step = 1.0;
      for (const Limit* limit : {&upper, &lower}) {
        step = std::min({step,
                         kToBoundary * way_to_boundary(limit->s, limit->change_of_s(aim, change)),
                         kToBoundary * way_to_boundary(limit->t, limit->change_of_t(aim, change))});
      }
      for (Limit* limit : {&upper, &lower}) {
        const Eigen::ArrayXd change_of_s = limit->change_of_s(aim, change);
        limit->t += step * limit->change_of_t(aim, change);
        limit->s += step * change_of_s;
      }
      base.go(step, next);
      jerk += step * change;
      gradient *= 1.0 - step;
      const Eigen::ArrayXd before = std::exchange(
          sides, (upper.s > upper.t).cast<double>() - (lower.s > lower.t).cast<double>());
      if ((sides != before).any()) {
        continue;
      }
      Base candidate = least_point(active(sides));
      if (keeps(sides, candidate)) {
        return candidate;
      }
    }
  }

 private:
  [[nodiscard]] Eigen::ArrayXd jerks(const Base& base) const {
    Eigen::ArrayXd result(static_cast<Eigen::Index>(defects_.size()));
    for (std::size_t k = 0; k < defects_.size(); ++k) {
      result(static_cast<Eigen::Index>(k)) = base.value(jerk_, k);
    }
    return result;
  }

  // The rows of the jerks that are beyond a limit, on the side 1 or −1.
  [[nodiscard]] JerkRows active(const Eigen::ArrayXd& sides) const {
    return {weight_ * sides.abs(), sides};
  }

  [[nodiscard]] bool keeps(const Eigen::ArrayXd& sides, const Base& base) const {
    const Eigen::ArrayXd jerk = jerks(base);
    return (sides == 0.0)
        .select(jerk.abs() <= 1.0 + kSideTolerance, sides * jerk >= 1.0 - kSideTolerance)
        .all();
  }

  // The least-squares point of the defects and these rows.
  [[nodiscard]] Base least_point(const JerkRows& jerk_rows) {
    ++iterations_;
    using Rows = Eigen::Matrix<double, 6, 5>;
    std::vector<Form> forms(defects_.size());
    // The rows that later intervals leave for (b_{k+1}, v_k, v_{k+1}).
    Eigen::Matrix<double, 3, 5> later = Eigen::Matrix<double, 3, 5>::Zero();
    for (std::size_t k = defects_.size(); k-- > 0;) {
      const auto row = static_cast<Eigen::Index>(k);
      Rows rows;
      rows.row(0) = defects_[k].position;
      rows.row(1) = defects_[k].velocity;
      rows.row(2) = jerk_rows.weight(row) * (jerk_ - jerk_rows.wanted(row) * unit(kConstant));
      for (int i = 0; i < 3; ++i) {
        const Form form = later.row(i);
        rows.row(3 + i) =
            form(kBase) * (unit(kBase) + 0.5 * nodes_.h * (unit(kNow) + unit(kNext))) +
            form(kBefore) * unit(kNow) + form(kNow) * unit(kNext) +
            form(kConstant) * unit(kConstant);
      }
      const Rows triangle =
          Eigen::HouseholderQR<Rows>(rows).matrixQR().triangularView<Eigen::Upper>();
      forms[k] = triangle.row(0);
      later = triangle.middleRows<3>(1);
    }
    return substitute(nodes_, forms);
  }

  const Nodes& nodes_;
  double weight_;  // of a row of the jerk in units of its limit
  Form jerk_;      // in these units
  std::vector<Defects> defects_;
  int iterations_ = 0;
};

}  // namespace

SolvedPath thesis_least_squares(const AxisPath& reference, const dynamics::FlexibleAxis& axis,
                                double period_s, double max_accel_mm_s2) {
  const Nodes nodes = sample(reference, period_s);
  LeastSquares least_squares(nodes, axis, max_accel_mm_s2);
  const Base base = least_squares.solve();
  // Two defects and a jerk for each interval, and the start.
  return {path_of(nodes, base),
          {nodes.count(), 3 * (nodes.count() - 1) + 1},
          least_squares.iterations()};
}

SolvedPath thesis_velocity_defects(const AxisPath& reference, const dynamics::FlexibleAxis& axis,
                                   double period_s) {
  const Nodes nodes = sample(reference, period_s);
  std::vector<Form> forms;
  for (std::size_t k = 0; k + 1 < nodes.count(); ++k) {
    forms.push_back(defects(nodes, axis, k).velocity);
  }
  // A defect for each interval, and the start.
  return {path_of(nodes, substitute(nodes, forms)), {nodes.count(), nodes.count()}, 1};
}

}  // namespace unflex::rivals
