#include "unflex/collocation/hargraves_paris.hpp"

#include <fmt/core.h>

#include <cassert>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

namespace unflex::collocation {
namespace {

constexpr int kMaxPair = 2 * kMaxPoint;
// Derivatives with respect to the pair (z₁, z₂) of an interval.
using PointByPair = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPoint, kMaxPair>;
using StateByPair = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxStates, kMaxPair>;
using PairByPair = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxPair, kMaxPair>;
using PairVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxPair, 1>;

// A structurally non-zero entry of a small matrix.
struct Entry {
  int row;
  int column;
};

// Data of one interval at its two nodes and its middle.
struct Interval {
  double t1 = 0.0;
  double t2 = 0.0;
  double h = 0.0;
  double tc = 0.0;
  PointVector z1;
  PointVector z2;
  PointVector zc;
  StateVector f1;
  StateVector f2;
};

class HargravesParis final : public nlp::Problem {
 public:
  HargravesParis(const OptimalControlProblem& problem, std::vector<double> times)
      : problem_(&problem),
        times_(std::move(times)),
        nx_(problem.states()),
        nu_(problem.controls()),
        nz_(nx_ + nu_),
        nodes_(static_cast<int>(times_.size())),
        slope_weight_(problem.slope_weight()) {
    assert(nodes_ >= 2 && nz_ <= kMaxPoint);
    const ControlVector limit = problem.slope_limit();
    for (int j = 0; j < nu_; ++j) {
      if (limit(j) < nlp::kNoBound) {
        limited_slopes_.push_back(j);
      }
    }
    rows_ = nx_ + static_cast<int>(limited_slopes_.size());
    set_bounds(limit);
    set_start();
    set_jacobian_pattern();
    set_hessian_pattern();
  }

  const nlp::Bounds& variable_bounds() const override { return variable_bounds_; }
  const nlp::Bounds& constraint_bounds() const override { return constraint_bounds_; }
  const std::vector<double>& start() const override { return start_; }
  bool linear_constraints() const override { return problem_->linear_dynamics(); }
  bool quadratic_objective() const override {
    return problem_->linear_dynamics() && problem_->quadratic_cost();
  }
  const nlp::Sparsity& jacobian_sparsity() const override { return jacobian_sparsity_; }
  const nlp::Sparsity& hessian_sparsity() const override { return hessian_sparsity_; }

  double objective(std::span<const double> x) const override {
    double sum = 0.0;
    Interval i;
    for (int k = 0; k + 1 < nodes_; ++k) {
      load(x, k, i);
      sum += i.h / 6.0 *
             (problem_->cost(i.t1, i.z1) + 4.0 * problem_->cost(i.tc, i.zc) +
              problem_->cost(i.t2, i.z2));
      for (int j = 0; j < nu_; ++j) {
        const double step = i.z2(nx_ + j) - i.z1(nx_ + j);
        sum += slope_weight_(j) * step * step / i.h;
      }
    }
    return sum;
  }

  void gradient(std::span<const double> x, std::span<double> gradient) const override {
    std::ranges::fill(gradient, 0.0);
    Interval i;
    PointVector l1(nz_);
    PointVector l2(nz_);
    PointVector lc(nz_);
    PointByPair zc_pair(nz_, 2 * nz_);
    PairVector pair(2 * nz_);
    for (int k = 0; k + 1 < nodes_; ++k) {
      load(x, k, i);
      problem_->cost_gradient(i.t1, i.z1, l1);
      problem_->cost_gradient(i.t2, i.z2, l2);
      problem_->cost_gradient(i.tc, i.zc, lc);
      middle_jacobian(i, zc_pair);
      pair.noalias() = (4.0 * i.h / 6.0) * (zc_pair.transpose() * lc);
      pair.head(nz_) += i.h / 6.0 * l1;
      pair.tail(nz_) += i.h / 6.0 * l2;
      for (int j = 0; j < nu_; ++j) {
        const double slope = 2.0 * slope_weight_(j) * (i.z2(nx_ + j) - i.z1(nx_ + j)) / i.h;
        pair(nx_ + j) -= slope;
        pair(nz_ + nx_ + j) += slope;
      }
      for (int j = 0; j < 2 * nz_; ++j) {
        gradient[static_cast<std::size_t>(k * nz_ + j)] += pair(j);
      }
    }
  }

  void constraints(std::span<const double> x, std::span<double> g) const override {
    Interval i;
    StateVector fc(nx_);
    for (int k = 0; k + 1 < nodes_; ++k) {
      load(x, k, i);
      problem_->dynamics(i.tc, i.zc, fc);
      const std::size_t row = static_cast<std::size_t>(k) * static_cast<std::size_t>(rows_);
      for (int s = 0; s < nx_; ++s) {
        const double xc_dot = -1.5 * (i.z1(s) - i.z2(s)) / i.h - 0.25 * (i.f1(s) + i.f2(s));
        g[row + static_cast<std::size_t>(s)] = xc_dot - fc(s);
      }
      for (std::size_t j = 0; j < limited_slopes_.size(); ++j) {
        const int u = nx_ + limited_slopes_[j];
        g[row + static_cast<std::size_t>(nx_) + j] = (i.z2(u) - i.z1(u)) / i.h;
      }
    }
  }

  void jacobian(std::span<const double> x, std::span<double> values) const override {
    Interval i;
    StateByPair d(nx_, 2 * nz_);
    std::size_t at = 0;
    for (int k = 0; k + 1 < nodes_; ++k) {
      load(x, k, i);
      defect_jacobian(i, d);
      for (const Entry& entry : defect_entries_) {
        values[at++] = d(entry.row, entry.column);
      }
      for (std::size_t j = 0; j < limited_slopes_.size(); ++j) {
        values[at++] = -1.0 / i.h;
        values[at++] = 1.0 / i.h;
      }
    }
  }

  void hessian(std::span<const double> x, double sigma, std::span<const double> lambda,
               std::span<double> values) const override {
    std::ranges::fill(values, 0.0);
    Interval i;
    PairByPair h(2 * nz_, 2 * nz_);
    StateVector mu(nx_);
    for (int k = 0; k + 1 < nodes_; ++k) {
      load(x, k, i);
      for (int s = 0; s < nx_; ++s) {
        mu(s) = lambda[static_cast<std::size_t>(k * rows_ + s)];
      }
      interval_hessian(i, sigma, mu, h);
      scatter_hessian(k, h, values);
    }
  }

  std::string variable_name(int index) const override {
    return fmt::format("{}, node {}", problem_->name(index % nz_), index / nz_);
  }

  std::string constraint_name(int index) const override {
    const int row = index % rows_;
    return row < nx_
               ? fmt::format("defect of {}, interval {}", problem_->name(row), index / rows_)
               : fmt::format(
                     "slope of {}, interval {}",
                     problem_->name(nx_ + limited_slopes_[static_cast<std::size_t>(row - nx_)]),
                     index / rows_);
  }

 private:
  void set_bounds(const ControlVector& slope_limit) {
    PointVector lower(nz_);
    PointVector upper(nz_);
    for (int k = 0; k < nodes_; ++k) {
      problem_->node_bounds(k, nodes_, lower, upper);
      variable_bounds_.lower.insert(variable_bounds_.lower.end(), lower.begin(), lower.end());
      variable_bounds_.upper.insert(variable_bounds_.upper.end(), upper.begin(), upper.end());
    }
    for (int k = 0; k + 1 < nodes_; ++k) {
      constraint_bounds_.lower.insert(constraint_bounds_.lower.end(), static_cast<std::size_t>(nx_),
                                      0.0);
      constraint_bounds_.upper.insert(constraint_bounds_.upper.end(), static_cast<std::size_t>(nx_),
                                      0.0);
      for (const int j : limited_slopes_) {
        constraint_bounds_.lower.push_back(-slope_limit(j));
        constraint_bounds_.upper.push_back(slope_limit(j));
      }
    }
  }

  void set_start() {
    PointVector z(nz_);
    for (int k = 0; k < nodes_; ++k) {
      problem_->guess(k, times_[static_cast<std::size_t>(k)], z);
      start_.insert(start_.end(), z.begin(), z.end());
    }
  }

  // Pattern of Δ: its x columns are I, fx and fx·fx, its u columns fu and fx·fu.
  void set_jacobian_pattern() {
    const StateByPointPattern f = problem_->dynamics_pattern();
    for (int row = 0; row < nx_; ++row) {
      for (int column = 0; column < 2 * nz_; ++column) {
        const int c = column % nz_;
        bool hit = row == c || f(row, c);
        for (int via = 0; via < nx_; ++via) {
          hit = hit || (f(row, via) && f(via, c));
        }
        if (hit) {
          defect_entries_.push_back({row, column});
        }
      }
    }
    for (int k = 0; k + 1 < nodes_; ++k) {
      for (const Entry& entry : defect_entries_) {
        jacobian_sparsity_.row.push_back(k * rows_ + entry.row);
        jacobian_sparsity_.column.push_back(k * nz_ + entry.column);
      }
      for (std::size_t j = 0; j < limited_slopes_.size(); ++j) {
        const int row = k * rows_ + nx_ + static_cast<int>(j);
        const int column = k * nz_ + nx_ + limited_slopes_[j];
        jacobian_sparsity_.row.insert(jacobian_sparsity_.row.end(), {row, row});
        jacobian_sparsity_.column.insert(jacobian_sparsity_.column.end(), {column, column + nz_});
      }
    }
  }

  // Pattern of an interval's Hessian over (z₁, z₂).
  Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic> pair_pattern() const {
    Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic> pattern(2 * nz_, 2 * nz_);
    pattern.setConstant(!problem_->linear_dynamics());
    const StateByPointPattern f = problem_->dynamics_pattern();
    const PointByPointPattern cost = problem_->cost_pattern();
    // z_c depends on component c of either node where this is set.
    const auto middle = [&](int row, int c) { return row == c || (row < nx_ && f(row, c)); };
    for (int a = 0; a < 2 * nz_; ++a) {
      for (int b = 0; b < 2 * nz_; ++b) {
        const int ca = a % nz_;
        const int cb = b % nz_;
        bool hit = pattern(a, b) || (ca == cb && ca >= nx_ && slope_weight_(ca - nx_) != 0.0);
        for (int r = 0; r < nz_ && !hit; ++r) {
          for (int s = 0; s < nz_ && !hit; ++s) {
            hit = cost(r, s) && middle(r, ca) && middle(s, cb);
          }
        }
        pattern(a, b) = hit;
      }
    }
    return pattern;
  }

  void set_hessian_pattern() {
    const auto pattern = pair_pattern();
    for (int a = 0; a < nz_; ++a) {
      for (int b = 0; b <= a; ++b) {
        if (pattern(a, b) || pattern(nz_ + a, nz_ + b)) {
          diagonal_entries_.push_back({a, b});
        }
      }
    }
    for (int a = 0; a < nz_; ++a) {
      for (int b = 0; b < nz_; ++b) {
        if (pattern(nz_ + a, b)) {
          coupling_entries_.push_back({a, b});
        }
      }
    }
    for (int k = 0; k < nodes_; ++k) {
      for (const Entry& entry : diagonal_entries_) {
        hessian_sparsity_.row.push_back(k * nz_ + entry.row);
        hessian_sparsity_.column.push_back(k * nz_ + entry.column);
      }
      if (k + 1 < nodes_) {
        for (const Entry& entry : coupling_entries_) {
          hessian_sparsity_.row.push_back((k + 1) * nz_ + entry.row);
          hessian_sparsity_.column.push_back(k * nz_ + entry.column);
        }
      }
    }
  }

  // Fills in everything that depends on the two nodes, and z_c.
  void load(std::span<const double> x, int k, Interval& i) const {
    const auto at = static_cast<std::size_t>(k);
    i.t1 = times_[at];
    i.t2 = times_[at + 1];
    i.h = i.t2 - i.t1;
    i.tc = 0.5 * (i.t1 + i.t2);
    i.z1 = node(*problem_, x, k);
    i.z2 = node(*problem_, x, k + 1);
    i.f1.resize(nx_);
    i.f2.resize(nx_);
    problem_->dynamics(i.t1, i.z1, i.f1);
    problem_->dynamics(i.t2, i.z2, i.f2);
    i.zc = 0.5 * (i.z1 + i.z2);
    i.zc.head(nx_) += i.h / 8.0 * (i.f1 - i.f2);
  }

  // ∂z_c/∂(z₁, z₂)
  void middle_jacobian(const Interval& i, PointByPair& zc_pair) const {
    StateByPoint fz1(nx_, nz_);
    StateByPoint fz2(nx_, nz_);
    problem_->dynamics_jacobian(i.t1, i.z1, fz1);
    problem_->dynamics_jacobian(i.t2, i.z2, fz2);
    zc_pair.setZero();
    for (int r = 0; r < nz_; ++r) {
      zc_pair(r, r) = 0.5;
      zc_pair(r, nz_ + r) = 0.5;
    }
    zc_pair.topLeftCorner(nx_, nz_) += i.h / 8.0 * fz1;
    zc_pair.topRightCorner(nx_, nz_) -= i.h / 8.0 * fz2;
  }

  // ∂Δ/∂(z₁, z₂)
  void defect_jacobian(const Interval& i, StateByPair& d) const {
    StateByPoint fz(nx_, nz_);
    PointByPair zc_pair(nz_, 2 * nz_);
    middle_jacobian(i, zc_pair);
    problem_->dynamics_jacobian(i.tc, i.zc, fz);
    d.noalias() = -fz * zc_pair;
    problem_->dynamics_jacobian(i.t1, i.z1, fz);
    d.leftCols(nz_) -= 0.25 * fz;
    problem_->dynamics_jacobian(i.t2, i.z2, fz);
    d.rightCols(nz_) -= 0.25 * fz;
    for (int s = 0; s < nx_; ++s) {
      d(s, s) -= 1.5 / i.h;
      d(s, nz_ + s) += 1.5 / i.h;
    }
  }

  // Hessian over (z₁, z₂) of  σ (cost of the interval) + μᵀ Δ.
  void interval_hessian(const Interval& i, double sigma, const StateVector& mu,
                        PairByPair& h) const {
    PointByPoint block(nz_, nz_);
    PointByPair zc_pair(nz_, 2 * nz_);
    middle_jacobian(i, zc_pair);
    problem_->cost_hessian(i.tc, i.zc, block);
    const double weight = sigma * i.h / 6.0;
    PointByPoint centre = 4.0 * weight * block;
    if (!problem_->linear_dynamics()) {
      problem_->dynamics_hessian(i.tc, i.zc, mu, block);
      centre -= block;
    }
    h.noalias() = zc_pair.transpose() * centre * zc_pair;
    problem_->cost_hessian(i.t1, i.z1, block);
    h.topLeftCorner(nz_, nz_) += weight * block;
    problem_->cost_hessian(i.t2, i.z2, block);
    h.bottomRightCorner(nz_, nz_) += weight * block;
    for (int j = 0; j < nu_; ++j) {
      const double r = 2.0 * sigma * slope_weight_(j) / i.h;
      const int a = nx_ + j;
      h(a, a) += r;
      h(nz_ + a, nz_ + a) += r;
      h(a, nz_ + a) -= r;
      h(nz_ + a, a) -= r;
    }
    if (!problem_->linear_dynamics()) {
      add_curvature_of_slopes(i, weight, mu, h);
    }
  }

  // f₁ and f₂ appear in x_c (with ± h/8) and in ẋ_c (with −1/4). So their own curvature counts too,
  // with the multipliers that reach it there.
  void add_curvature_of_slopes(const Interval& i, double weight, const StateVector& mu,
                               PairByPair& h) const {
    PointVector lc(nz_);
    StateByPoint fz(nx_, nz_);
    PointByPoint block(nz_, nz_);
    problem_->cost_gradient(i.tc, i.zc, lc);
    problem_->dynamics_jacobian(i.tc, i.zc, fz);
    const StateVector through_middle =
        i.h / 8.0 * (4.0 * weight * lc.head(nx_) - fz.leftCols(nx_).transpose() * mu);
    problem_->dynamics_hessian(i.t1, i.z1, through_middle - 0.25 * mu, block);
    h.topLeftCorner(nz_, nz_) += block;
    problem_->dynamics_hessian(i.t2, i.z2, -through_middle - 0.25 * mu, block);
    h.bottomRightCorner(nz_, nz_) += block;
  }

  void scatter_hessian(int k, const PairByPair& h, std::span<double> values) const {
    const std::size_t stride = diagonal_entries_.size() + coupling_entries_.size();
    std::size_t at = static_cast<std::size_t>(k) * stride;
    for (const Entry& entry : diagonal_entries_) {
      values[at++] += h(entry.row, entry.column);
    }
    for (const Entry& entry : coupling_entries_) {
      values[at++] += h(nz_ + entry.row, entry.column);
    }
    for (const Entry& entry : diagonal_entries_) {
      values[at++] += h(nz_ + entry.row, nz_ + entry.column);
    }
  }

  const OptimalControlProblem* problem_;
  std::vector<double> times_;
  int nx_;
  int nu_;
  int nz_;
  int nodes_;
  int rows_ = 0;  // constraints per interval
  ControlVector slope_weight_;
  std::vector<int> limited_slopes_;  // controls with a slope row
  nlp::Bounds variable_bounds_;
  nlp::Bounds constraint_bounds_;
  std::vector<double> start_;
  nlp::Sparsity jacobian_sparsity_;
  nlp::Sparsity hessian_sparsity_;
  std::vector<Entry> defect_entries_;    // entries of Δ over (z₁, z₂)
  std::vector<Entry> diagonal_entries_;  // entries of a node's own Hessian block, lower triangle
  std::vector<Entry> coupling_entries_;  // entries of the block (node k+1, node k)
};

}  // namespace

std::unique_ptr<nlp::Problem> transcribe(const OptimalControlProblem& problem,
                                         std::vector<double> times) {
  return std::make_unique<HargravesParis>(problem, std::move(times));
}

PointVector node(const OptimalControlProblem& problem, std::span<const double> x, int k) {
  const int nz = problem.states() + problem.controls();
  return Eigen::Map<const Eigen::VectorXd>(x.data() + static_cast<std::ptrdiff_t>(k) * nz, nz);
}

}  // namespace unflex::collocation
