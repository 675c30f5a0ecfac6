#include <gtest/gtest.h>

#include <random>

#include "derivative_check.hpp"
#include "test_problems.hpp"
#include "unflex/collocation/hargraves_paris.hpp"

namespace unflex::collocation {
namespace {

using nlp::testing::expect_exact_derivatives;
using nlp::testing::expect_sound_patterns;
using nlp::testing::random_vector;
using testing::DrivenPendulum;
using testing::LinearPendulum;

// A mesh from 0.4 on with steps between 0.05 and 0.4.
std::vector<double> uneven_mesh(std::mt19937_64& random, int nodes) {
  std::uniform_real_distribution<double> step(0.05, 0.4);
  std::vector<double> times = {0.4};
  while (static_cast<int>(times.size()) < nodes) {
    times.push_back(times.back() + step(random));
  }
  return times;
}

template <class Problem>
void expect_exact_at_random_points(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const Problem problem;
  for (int trial = 0; trial < 20; ++trial) {
    const auto program = transcribe(problem, uneven_mesh(random, 2 + trial % 5));
    const auto x = random_vector(random, program->start().size(), 1.5);
    const auto lambda = random_vector(random, program->constraint_bounds().lower.size(), 2.0);
    expect_exact_derivatives(*program, x, 1.0, lambda);
    expect_exact_derivatives(*program, x, 0.0, lambda);
    expect_exact_derivatives(*program, x, -0.7, std::vector<double>(lambda.size(), 0.0));
  }
}

TEST(HargravesParis, HasExactDerivativesWhenEverythingIsNonlinearAndChangesWithTime) {
  expect_exact_at_random_points<DrivenPendulum>(1);
}

TEST(HargravesParis, HasExactDerivativesOfANonquadraticCostOnLinearDynamics) {
  expect_exact_at_random_points<LinearPendulum>(2);
}

TEST(HargravesParis, HasPatternsWithoutRepetition) {
  const DrivenPendulum nonlinear;
  const LinearPendulum linear;
  for (const int nodes : {2, 3, 6}) {
    std::mt19937_64 random(3);
    expect_sound_patterns(*transcribe(nonlinear, uneven_mesh(random, nodes)));
    expect_sound_patterns(*transcribe(linear, uneven_mesh(random, nodes)));
  }
}

TEST(HargravesParis, LeavesOutWhatIsZeroByStructure) {
  // In the linear pendulum's dynamics θ, v and u do not depend on w and q.
  const LinearPendulum problem;
  const auto program = transcribe(problem, {0.0, 0.1, 0.2});
  const nlp::Sparsity& sparsity = program->jacobian_sparsity();
  for (std::size_t i = 0; i < sparsity.row.size(); ++i) {
    const int row = sparsity.row[i] % 4;  // three defects and a slope
    const int column = sparsity.column[i] % 5;
    if (row <= 1) {
      EXPECT_TRUE(column != LinearPendulum::kQ && column != LinearPendulum::kW) << i;
    }
  }
}

TEST(HargravesParis, DeclaresConstantDerivativesOnlyWhereTheyAre) {
  const DrivenPendulum nonlinear;
  const LinearPendulum linear;
  testing::LinearQuadratic quadratic;
  quadratic.a = Eigen::MatrixXd::Zero(1, 1);
  quadratic.b = Eigen::MatrixXd::Ones(1, 1);
  quadratic.q = Eigen::MatrixXd::Identity(2, 2);
  EXPECT_FALSE(transcribe(nonlinear, {0.0, 1.0})->linear_constraints());
  EXPECT_FALSE(transcribe(nonlinear, {0.0, 1.0})->quadratic_objective());
  EXPECT_TRUE(transcribe(linear, {0.0, 1.0})->linear_constraints());
  EXPECT_FALSE(transcribe(linear, {0.0, 1.0})->quadratic_objective());
  EXPECT_TRUE(transcribe(quadratic, {0.0, 1.0})->linear_constraints());
  EXPECT_TRUE(transcribe(quadratic, {0.0, 1.0})->quadratic_objective());
}

}  // namespace
}  // namespace unflex::collocation
