// The interior point is Mehrotra's predictor and corrector (S. J. Wright, "Primal-Dual
// Interior-Point Methods", SIAM 1997, chapter 10). A side of a bound is s = b − σ g(u) > 0 with a
// multiplier λ > 0; the Newton step eliminates both:
//
//   (H + Gᵀ (λ/s) G) Δu + c μ = −∇f + …,    cᵀ Δu = the miss of Σ x = Σ w
#include "pressure_program.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "unflex/core/math.hpp"

namespace unflex::emit {
namespace {

constexpr double kLeastSlope_s = 1e-3;
constexpr int kMostIterations = 60;
constexpr double kPrecision = 1e-7;  // of the cost
constexpr double kShareOfWay = 0.99;

// A symmetric matrix with two diagonals on either side of its own, and its factors L D Lᵀ.
class Pentadiagonal {
 public:
  explicit Pentadiagonal(std::size_t size) : own_(size), next_(size), second_(size) {}

  void clear() {
    std::ranges::fill(own_, 0.0);
    std::ranges::fill(next_, 0.0);
    std::ranges::fill(second_, 0.0);
  }
  // Adds at row i and column j.
  void add(std::size_t i, std::size_t j, double value) {
    const std::size_t row = std::max(i, j);
    const std::size_t below = row - std::min(i, j);
    (below == 0 ? own_ : below == 1 ? next_ : second_)[row] += value;
  }
  void factor() {
    for (std::size_t i = 0; i < own_.size(); ++i) {
      if (i >= 2) {
        const double of_second = second_[i];
        second_[i] = of_second / own_[i - 2];
        next_[i] -= of_second * next_[i - 1];
        own_[i] -= second_[i] * of_second;
      }
      if (i >= 1) {
        const double of_next = next_[i];
        next_[i] = of_next / own_[i - 1];
        own_[i] -= next_[i] * of_next;
      }
      own_[i] = std::max(own_[i], std::numeric_limits<double>::min());
    }
  }
  // Solves in place.
  void solve(std::vector<double>& x) const {
    for (std::size_t i = 1; i < x.size(); ++i) {
      x[i] -= next_[i] * x[i - 1] + (i >= 2 ? second_[i] * x[i - 2] : 0.0);
    }
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] /= own_[i];
    }
    for (std::size_t i = x.size(); i-- > 0;) {
      x[i] -= (i + 1 < x.size() ? next_[i + 1] * x[i + 1] : 0.0) +
              (i + 2 < x.size() ? second_[i + 2] * x[i + 2] : 0.0);
    }
  }

 private:
  std::vector<double> own_;
  std::vector<double> next_;    // at row i: column i − 1
  std::vector<double> second_;  // at row i: column i − 2
};

// A linear function of up to three neighbouring unknowns.
struct Row {
  std::size_t first = 0;  // the first unknown
  std::size_t count = 0;
  std::array<double, 3> factor{};
  double constant = 0.0;

  [[nodiscard]] double of(const std::vector<double>& u) const {
    double sum = constant;
    for (std::size_t i = 0; i < count; ++i) {
      sum += factor[i] * u[first + i];
    }
    return sum;
  }
  [[nodiscard]] double step(const std::vector<double>& du) const { return of(du) - constant; }
  void add_to(std::vector<double>& gradient, double times) const {
    for (std::size_t i = 0; i < count; ++i) {
      gradient[first + i] += times * factor[i];
    }
  }
  void add_to(Pentadiagonal& hessian, double times) const {
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        hessian.add(first + i, first + j, times * factor[i] * factor[j]);
      }
    }
  }
};

// A part of the cost: ½ weight row².
struct Term {
  Row row;
  double weight = 0.0;
};

// One side of a bound: σ row ≤ bound.
struct Side {
  std::size_t row = 0;
  double sign = 1.0;
  double bound = 0.0;
  double slack = 0.0;
  double multiplier = 0.0;
  double slack_step = 0.0;
  double multiplier_step = 0.0;
};

class PressureProgram {
 public:
  PressureProgram(const std::vector<PressureLine>& lines, const PressureEnds& ends)
      : n_(lines.size()), pushed_(n_), hessian_(n_) {
    for (std::size_t k = 0; k < n_; ++k) {
      add_line(lines, ends, k);
      wanted_mm_ += lines[k].wanted_mm;
    }
    wanted_mm_ += ends.end_mm - ends.begin_mm;
    for (std::size_t k = 0; k + 1 < n_; ++k) {
      add_end(lines, k);
    }
    add_last(lines.back(), ends);
    for (std::size_t j = 0; j + 1 < n_; ++j) {
      add_join(lines, j);
    }
    sum_.assign(n_, 0.0);
    for (const Row& row : pushed_) {
      row.add_to(sum_, 1.0);
    }
    start(lines);
  }

  bool solve() {
    for (int i = 0; i < kMostIterations; ++i) {
      if (iterate()) {
        return true;
      }
    }
    return false;
  }

  [[nodiscard]] std::vector<double> pushed() const {
    std::vector<double> result;
    for (const Row& row : pushed_) {
      result.push_back(row.of(u_));
    }
    return result;
  }

 private:
  // x and ε of line k. Unknown i is u_{i+1}.
  void add_line(const std::vector<PressureLine>& lines, const PressureEnds& ends, std::size_t k) {
    const PressureLine& line = lines[k];
    const double slope_s = std::max(line.slope_s, kLeastSlope_s);
    const double left = math::exp(-line.duration_s / slope_s);
    const double alpha = line.duration_s / (slope_s * (1.0 - left));
    Row x;
    x.constant = -line.duration_s * line.rest_mm / slope_s;
    Row error;
    const auto add = [&](std::size_t unknown, double of_x, double of_error) {
      if (x.count == 0) {
        x.first = error.first = unknown;
      }
      x.factor[x.count++] = of_x;
      error.factor[error.count++] = of_error;
    };
    double constant = 0.0;
    if (k > 0) {
      add(k - 1, -left * alpha, 1.0 - left * alpha);
    } else {
      x.constant -= left * alpha * ends.begin_mm;
      constant += ends.begin_mm;
    }
    add(k, alpha, alpha - 1.0);
    error.constant = x.constant + constant - line.wanted_mm;
    pushed_[k] = x;
    terms_.push_back({error, line.weight});
  }

  void add_join(const std::vector<PressureLine>& lines, std::size_t j) {
    const PressureLine& a = lines[j];
    const PressureLine& b = lines[j + 1];
    Row f;
    if (a.length_mm > 0.0 && b.length_mm > 0.0) {
      const double v = std::min(a.speed_mm_s(), b.speed_mm_s());
      const Row& before = pushed_[j];
      const Row& after = pushed_[j + 1];
      f.first = before.first;
      const auto add = [&](const Row& x, double times) {
        for (std::size_t i = 0; i < x.count; ++i) {
          f.factor[x.first + i - f.first] += times * x.factor[i];
          f.count = std::max(f.count, x.first + i - f.first + 1);
        }
        f.constant += times * x.constant;
      };
      add(before, -v / a.length_mm);
      add(after, v / b.length_mm);
    }
    joins_.push_back(f);
    terms_.push_back({f, kSmoothness});
  }

  // η of line k. The wanted flow at the line's end lies between the flows of line k and of the next
  // line.
  void add_end(const std::vector<PressureLine>& lines, std::size_t k) {
    const PressureLine& a = lines[k];
    const PressureLine& b = lines[k + 1];
    const double share = a.duration_s / (a.duration_s + b.duration_s);
    const auto between = [&](double of_a, double of_b) { return of_a + share * (of_b - of_a); };
    const double slope_s = std::max(between(a.slope_s, b.slope_s), kLeastSlope_s);
    const double flow_mm_s = between(a.wanted_mm / a.duration_s, b.wanted_mm / b.duration_s);
    u_.push_back(between(a.rest_mm, b.rest_mm) + slope_s * flow_mm_s);
    const double duration_s = std::min(a.duration_s, b.duration_s);
    Row end;
    end.first = k;
    end.count = 1;
    end.factor[0] = duration_s / slope_s;
    end.constant = -end.factor[0] * u_.back();
    terms_.push_back({end, kAtEnds * a.weight});
  }

  // u_n − U.
  void add_last(const PressureLine& line, const PressureEnds& ends) {
    Row last;
    last.first = n_ - 1;
    last.count = 1;
    last.factor[0] = 1.0;
    last.constant = -ends.end_mm;
    terms_.push_back({last, line.weight});
    u_.push_back(ends.end_mm);
  }

  void start(const std::vector<PressureLine>& lines) {
    rows_ = joins_;
    rows_.insert(rows_.end(), pushed_.begin(), pushed_.end());
    for (std::size_t j = 0; j < joins_.size(); ++j) {
      if (joins_[j].count > 0 && std::isfinite(lines[j].most_step_mm_s)) {
        sides_.push_back({j, 1.0, lines[j].most_step_mm_s});
        sides_.push_back({j, -1.0, lines[j].most_step_mm_s});
      }
    }
    for (std::size_t k = 0; k < n_; ++k) {
      if (std::isfinite(lines[k].least_mm)) {
        sides_.push_back({joins_.size() + k, -1.0, -lines[k].least_mm});
      }
      if (std::isfinite(lines[k].most_mm)) {
        sides_.push_back({joins_.size() + k, 1.0, lines[k].most_mm});
      }
    }
    double cost = cost_of(u_) + 1e-9;
    for (Side& side : sides_) {
      const double room = side.bound - side.sign * rows_[side.row].of(u_);
      const double least = 0.1 * std::abs(side.bound) + 1e-4;
      side.slack = std::max({room, least, -0.5 * room});
      side.multiplier = std::max(cost / static_cast<double>(n_), 1e-6) / side.slack;
    }
  }

  [[nodiscard]] double cost_of(const std::vector<double>& u) const {
    double cost = 0.0;
    for (const Term& term : terms_) {
      const double value = term.row.of(u);
      cost += 0.5 * term.weight * value * value;
    }
    return cost;
  }

  // One step. True if the point was the solution already.
  bool iterate() {
    double gap = 0.0;
    double miss = 0.0;
    for (const Side& side : sides_) {
      gap += side.slack * side.multiplier;
      miss = std::max(miss, std::abs(residual(side)) / (std::abs(side.bound) + 1e-3));
    }
    const double sum_miss = wanted_mm_ - sum_of_pushed();
    if (gap <= kPrecision * cost_of(u_) + 1e-12 && miss < 1e-6 && std::abs(sum_miss) < 1e-9 &&
        steps_ > 0) {
      return true;
    }
    assemble();
    std::vector<double> to_sum = sum_;
    hessian_.solve(to_sum);
    const double mean = sides_.empty() ? 0.0 : gap / static_cast<double>(sides_.size());
    std::vector<double> du = newton(0.0, false, to_sum, sum_miss);
    const double affine = longest();
    double after = 0.0;
    for (const Side& side : sides_) {
      after += (side.slack + affine * side.slack_step) *
               (side.multiplier + affine * side.multiplier_step);
    }
    const double ratio = gap > 0.0 ? after / gap : 0.0;
    du = newton(mean * ratio * ratio * ratio, true, to_sum, sum_miss);
    const double length = std::min(1.0, kShareOfWay * longest_beyond());
    for (std::size_t i = 0; i < u_.size(); ++i) {
      u_[i] += length * du[i];
    }
    for (Side& side : sides_) {
      side.slack += length * side.slack_step;
      side.multiplier += length * side.multiplier_step;
    }
    ++steps_;
    return sides_.empty();
  }

  // By how much σ g + s misses the bound.
  [[nodiscard]] double residual(const Side& side) const {
    return side.sign * rows_[side.row].of(u_) + side.slack - side.bound;
  }

  [[nodiscard]] double sum_of_pushed() const {
    double sum = 0.0;
    for (const Row& row : pushed_) {
      sum += row.of(u_);
    }
    return sum;
  }

  void assemble() {
    hessian_.clear();
    for (const Term& term : terms_) {
      term.row.add_to(hessian_, term.weight);
    }
    for (const Side& side : sides_) {
      rows_[side.row].add_to(hessian_, side.multiplier / side.slack);
    }
    hessian_.factor();
  }

  std::vector<double> newton(double target, bool correct, const std::vector<double>& to_sum,
                             double sum_miss) {
    std::vector<double> right(u_.size(), 0.0);
    for (const Term& term : terms_) {
      term.row.add_to(right, -term.weight * term.row.of(u_));
    }
    const auto aim = [&](const Side& side) {
      return target - (correct ? side.slack_step * side.multiplier_step : 0.0);
    };
    for (const Side& side : sides_) {
      const double pull = aim(side) / side.slack + side.multiplier / side.slack * residual(side);
      rows_[side.row].add_to(right, -side.sign * pull);
    }
    hessian_.solve(right);
    double along = 0.0;
    double own = 0.0;
    for (std::size_t i = 0; i < u_.size(); ++i) {
      along += sum_[i] * right[i];
      own += sum_[i] * to_sum[i];
    }
    const double mu = own > 0.0 ? (along - sum_miss) / own : 0.0;
    for (std::size_t i = 0; i < u_.size(); ++i) {
      right[i] -= mu * to_sum[i];
    }
    for (Side& side : sides_) {
      const double aimed = aim(side);
      side.slack_step = -residual(side) - side.sign * rows_[side.row].step(right);
      side.multiplier_step =
          aimed / side.slack - side.multiplier - side.multiplier / side.slack * side.slack_step;
    }
    return right;
  }

  [[nodiscard]] double longest_beyond() const {
    double length = std::numeric_limits<double>::infinity();
    for (const Side& side : sides_) {
      if (side.slack_step < 0.0) {
        length = std::min(length, -side.slack / side.slack_step);
      }
      if (side.multiplier_step < 0.0) {
        length = std::min(length, -side.multiplier / side.multiplier_step);
      }
    }
    return length;
  }
  [[nodiscard]] double longest() const { return std::min(1.0, longest_beyond()); }

  std::size_t n_;
  std::vector<Row> pushed_;  // x
  std::vector<Row> joins_;   // f
  std::vector<Row> rows_;    // f, then x
  std::vector<Term> terms_;  // ε, then η and u_n − U, then f
  std::vector<double> sum_;  // gradient of Σ x
  double wanted_mm_ = 0.0;   // Σ w
  Pentadiagonal hessian_;
  std::vector<Side> sides_;
  std::vector<double> u_;
  int steps_ = 0;
};

}  // namespace

std::vector<double> pushed_filament(const std::vector<PressureLine>& lines,
                                    const PressureEnds& ends) {
  if (lines.size() >= 2) {
    PressureProgram program(lines, ends);
    if (program.solve()) {
      return program.pushed();
    }
  }
  std::vector<double> wanted;
  for (const PressureLine& line : lines) {
    wanted.push_back(line.wanted_mm);
  }
  return wanted;
}

}  // namespace unflex::emit
