// Derivatives of a nonlinear program against central differences, and the pattern they come in.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "unflex/nlp/problem.hpp"

namespace unflex::nlp::testing {

using Dense = Eigen::MatrixXd;

inline Dense dense(const Sparsity& sparsity, const std::vector<double>& values, std::size_t rows,
                   std::size_t columns) {
  Dense result = Dense::Zero(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
  for (std::size_t i = 0; i < values.size(); ++i) {
    result(sparsity.row[i], sparsity.column[i]) += values[i];
  }
  return result;
}

inline Dense jacobian_at(const Problem& problem, const std::vector<double>& x) {
  const Sparsity& sparsity = problem.jacobian_sparsity();
  std::vector<double> values(sparsity.row.size());
  problem.jacobian(x, values);
  return dense(sparsity, values, problem.constraint_bounds().lower.size(), x.size());
}

// The Hessian of σ f + λᵀ g, both triangles.
inline Dense hessian_at(const Problem& problem, const std::vector<double>& x, double sigma,
                        const std::vector<double>& lambda) {
  const Sparsity& sparsity = problem.hessian_sparsity();
  std::vector<double> values(sparsity.row.size());
  problem.hessian(x, sigma, lambda, values);
  const Dense lower = dense(sparsity, values, x.size(), x.size());
  Dense both = lower + lower.transpose();
  both.diagonal() = lower.diagonal();
  return both;
}

inline Eigen::VectorXd gradient_at(const Problem& problem, const std::vector<double>& x) {
  std::vector<double> gradient(x.size());
  problem.gradient(x, gradient);
  return Eigen::Map<const Eigen::VectorXd>(gradient.data(),
                                           static_cast<Eigen::Index>(gradient.size()));
}

inline Eigen::VectorXd constraints_at(const Problem& problem, const std::vector<double>& x) {
  Eigen::VectorXd g(static_cast<Eigen::Index>(problem.constraint_bounds().lower.size()));
  problem.constraints(x, {g.data(), static_cast<std::size_t>(g.size())});
  return g;
}

inline std::vector<double> random_vector(std::mt19937_64& random, std::size_t n, double size) {
  std::uniform_real_distribution<double> uniform(-size, size);
  std::vector<double> result(n);
  std::ranges::generate(result, [&] { return uniform(random); });
  return result;
}

// ∂F/∂x by central differences, column by column; error O(step²) plus rounding.
template <class Function>
Dense central_differences(const Function& function, std::vector<double> x, double step) {
  Dense result(function(x).size(), static_cast<Eigen::Index>(x.size()));
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double at = x[i];
    const double h = step * std::max(1.0, std::abs(at));
    x[i] = at + h;
    const Eigen::VectorXd above = function(x);
    x[i] = at - h;
    const Eigen::VectorXd below = function(x);
    x[i] = at;
    result.col(static_cast<Eigen::Index>(i)) = (above - below) / (2.0 * h);
  }
  return result;
}

// The patterns name every entry once, inside the matrix, and the Hessian's lower triangle only.
inline void expect_sound_patterns(const Problem& problem) {
  const auto n = static_cast<int>(problem.start().size());
  const auto m = static_cast<int>(problem.constraint_bounds().lower.size());
  const auto check = [n](const Sparsity& sparsity, int rows, bool lower) {
    ASSERT_EQ(sparsity.row.size(), sparsity.column.size());
    std::set<std::pair<int, int>> seen;
    for (std::size_t i = 0; i < sparsity.row.size(); ++i) {
      const int row = sparsity.row[i];
      const int column = sparsity.column[i];
      EXPECT_TRUE(row >= 0 && row < rows && column >= 0 && column < n) << row << ", " << column;
      EXPECT_TRUE(!lower || column <= row) << row << ", " << column;
      EXPECT_TRUE(seen.insert({row, column}).second) << row << ", " << column << " twice";
    }
  };
  check(problem.jacobian_sparsity(), m, false);
  check(problem.hessian_sparsity(), n, true);
}

// Checks gradient, Jacobian and Hessian at x as dense matrices. An entry that the pattern lacks
// shows as a zero where the differences are not zero. The tolerance is relative to the largest
// entry.
inline void expect_exact_derivatives(const Problem& problem, const std::vector<double>& x,
                                     double sigma, const std::vector<double>& lambda,
                                     double tolerance = 1e-8, double step = 1e-5) {
  const Eigen::Map<const Eigen::VectorXd> multipliers(lambda.data(),
                                                      static_cast<Eigen::Index>(lambda.size()));
  const auto objective = [&](const std::vector<double>& at) {
    return Eigen::VectorXd::Constant(1, problem.objective(at));
  };
  const auto constraints = [&](const std::vector<double>& at) {
    return constraints_at(problem, at);
  };
  const auto lagrangian_gradient = [&](const std::vector<double>& at) -> Eigen::VectorXd {
    return sigma * gradient_at(problem, at) + jacobian_at(problem, at).transpose() * multipliers;
  };
  const auto compare = [&](const char* what, const Dense& exact, const Dense& differences) {
    ASSERT_EQ(exact.rows(), differences.rows()) << what;
    ASSERT_EQ(exact.cols(), differences.cols()) << what;
    const double scale = std::max(1.0, differences.cwiseAbs().maxCoeff());
    Eigen::Index row = 0;
    Eigen::Index column = 0;
    const double worst = (exact - differences).cwiseAbs().maxCoeff(&row, &column);
    EXPECT_LE(worst, tolerance * scale)
        << what << " at " << row << ", " << column << ": " << exact(row, column) << " against "
        << differences(row, column);
  };
  compare("gradient", gradient_at(problem, x).transpose(), central_differences(objective, x, step));
  compare("Jacobian", jacobian_at(problem, x), central_differences(constraints, x, step));
  compare("Hessian", hessian_at(problem, x, sigma, lambda),
          central_differences(lagrangian_gradient, x, step));
}

}  // namespace unflex::nlp::testing
