#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>

#include "derivative_check.hpp"
#include "test_problems.hpp"
#include "unflex/collocation/hargraves_paris.hpp"

namespace unflex::collocation {
namespace {

using nlp::testing::constraints_at;
using nlp::testing::random_vector;
using testing::DrivenPendulum;

const std::vector<double> kUnevenMesh = {0.3, 0.5, 0.55, 1.2, 1.5};

// One state's cubic c₀ + c₁ t + c₂ t² + c₃ t³ from values and slopes at both ends, by a linear
// system.
Eigen::Vector4d cubic_through(double t1, double x1, double f1, double t2, double x2, double f2) {
  Eigen::Matrix4d conditions;
  conditions << 1.0, t1, t1 * t1, std::pow(t1, 3),  //
      0.0, 1.0, 2.0 * t1, 3.0 * t1 * t1,            //
      1.0, t2, t2 * t2, std::pow(t2, 3),            //
      0.0, 1.0, 2.0 * t2, 3.0 * t2 * t2;
  return conditions.fullPivLu().solve(Eigen::Vector4d(x1, f1, x2, f2));
}

double value(const Eigen::Vector4d& c, double t) {
  return c(0) + t * (c(1) + t * (c(2) + t * c(3)));
}

double slope(const Eigen::Vector4d& c, double t) {
  return c(1) + t * (2.0 * c(2) + t * 3.0 * c(3));
}

TEST(HargravesParis, HasForDefectTheSlopeErrorOfTheCubicInTheMiddle) {
  const DrivenPendulum problem;
  const auto program = transcribe(problem, kUnevenMesh);
  std::mt19937_64 random(4);
  for (int trial = 0; trial < 50; ++trial) {
    const auto x = random_vector(random, program->start().size(), 1.5);
    const Eigen::VectorXd g = constraints_at(*program, x);
    ASSERT_EQ(g.size(), 4 * 4);
    for (int k = 0; k < 4; ++k) {
      const double t1 = kUnevenMesh[static_cast<std::size_t>(k)];
      const double t2 = kUnevenMesh[static_cast<std::size_t>(k) + 1];
      const double tc = 0.5 * (t1 + t2);
      const PointVector z1 = node(problem, x, k);
      const PointVector z2 = node(problem, x, k + 1);
      StateVector f1(3);
      StateVector f2(3);
      StateVector fc(3);
      problem.dynamics(t1, z1, f1);
      problem.dynamics(t2, z2, f2);
      PointVector zc = 0.5 * (z1 + z2);
      StateVector slope_c(3);
      for (int s = 0; s < 3; ++s) {
        const Eigen::Vector4d c = cubic_through(t1, z1(s), f1(s), t2, z2(s), f2(s));
        zc(s) = value(c, tc);
        slope_c(s) = slope(c, tc);
      }
      problem.dynamics(tc, zc, fc);
      for (int s = 0; s < 3; ++s) {
        EXPECT_NEAR(g(4 * k + s), slope_c(s) - fc(s), 1e-9) << "interval " << k << ", state " << s;
      }
      EXPECT_NEAR(g(4 * k + 3), (z2(4) - z1(4)) / (t2 - t1), 1e-12);
    }
  }
}

TEST(HargravesParis, OrdersUnknownsByNodesStatesBeforeControls) {
  const DrivenPendulum problem;
  const auto program = transcribe(problem, {0.0, 0.5, 1.5});
  // The guess of node k at time t is (t, 10k, −t, 1/4, k/2).
  EXPECT_EQ(program->start(), (std::vector<double>{0.0, 0.0, -0.0, 0.25, 0.0,   //
                                                   0.5, 10.0, -0.5, 0.25, 0.5,  //
                                                   1.5, 20.0, -1.5, 0.25, 1.0}));
  const PointVector last = node(problem, program->start(), 2);
  EXPECT_EQ(last(DrivenPendulum::kV), 20.0);
  EXPECT_EQ(last(DrivenPendulum::kW), 1.0);
}

TEST(HargravesParis, NamesUnknownsAndConstraintsByComponentAndPlace) {
  const DrivenPendulum problem;
  const auto program = transcribe(problem, {0.0, 0.5, 1.5});
  EXPECT_EQ(program->variable_name(0), "angle, node 0");
  EXPECT_EQ(program->variable_name(8), "torque, node 1");
  EXPECT_EQ(program->variable_name(14), "current, node 2");
  EXPECT_EQ(program->constraint_name(0), "defect of angle, interval 0");
  EXPECT_EQ(program->constraint_name(3), "slope of current, interval 0");
  EXPECT_EQ(program->constraint_name(6), "defect of charge, interval 1");
  EXPECT_EQ(program->constraint_name(7), "slope of current, interval 1");
}

TEST(HargravesParis, BoundsNodesAndDefectsAndLimitedSlopes) {
  const DrivenPendulum problem;
  const auto program = transcribe(problem, {0.0, 0.5, 1.5});
  const nlp::Bounds& variables = program->variable_bounds();
  const nlp::Bounds& constraints = program->constraint_bounds();
  ASSERT_EQ(variables.lower.size(), 15U);
  ASSERT_EQ(variables.upper.size(), 15U);
  EXPECT_EQ(variables.lower[0], 0.5);
  EXPECT_EQ(variables.upper[0], 0.5);
  EXPECT_EQ(variables.lower[2], -0.2);
  EXPECT_EQ(variables.lower[5], -nlp::kNoBound);
  const std::vector<double> expected = {0.0, 0.0, 0.0, 2.5, 0.0, 0.0, 0.0, 2.5};
  ASSERT_EQ(constraints.lower.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(constraints.upper[i], expected[i]);
    EXPECT_EQ(constraints.lower[i], -expected[i]);
  }
}

TEST(HargravesParis, AddsTheSlopeCostExactly) {
  testing::LinearQuadratic problem;
  problem.a = Eigen::MatrixXd::Zero(1, 1);
  problem.b = Eigen::MatrixXd::Ones(1, 1);
  problem.q = Eigen::MatrixXd::Zero(2, 2);
  problem.weight_of_slope = 3.0;
  const auto program = transcribe(problem, {0.0, 0.5, 2.0});
  // u: 1, 2, −1, so 3 (½ · 2² + 1.5 · 2²).
  EXPECT_NEAR(program->objective(std::vector<double>{7.0, 1.0, 8.0, 2.0, 9.0, -1.0}), 24.0, 1e-12);
}

TEST(HargravesParis, IntegratesTheCostBySimpsonsRule) {
  // ẋ = 2t exactly met by x = t²: L = x + u = t² + t³ is integrated exactly on any mesh, and
  // L = x² = t⁴ with Simpson's error h⁴/2880 · 24 · length.
  testing::LinearQuadratic problem;
  problem.a = Eigen::MatrixXd::Zero(1, 1);
  problem.b = Eigen::MatrixXd::Zero(1, 1);
  problem.q = Eigen::MatrixXd::Zero(2, 2);
  problem.q(0, 0) = 1.0;
  problem.drift = [](double t) { return Eigen::VectorXd::Constant(1, 2.0 * t); };
  for (const int intervals : {1, 2, 5}) {
    std::vector<double> times;
    std::vector<double> x;
    for (int k = 0; k <= intervals; ++k) {
      const double t = static_cast<double>(k) / intervals;
      times.push_back(t);
      x.insert(x.end(), {t * t, 0.0});
    }
    const auto program = transcribe(problem, times);
    EXPECT_NEAR(program->objective(x) - 0.2, 24.0 / 2880.0 / std::pow(intervals, 4), 1e-15);
    EXPECT_NEAR(constraints_at(*program, x).norm(), 0.0, 1e-14);
  }
}

}  // namespace
}  // namespace unflex::collocation
