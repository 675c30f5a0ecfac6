#include "unflex/rivals/thesis_method.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <vector>

#include "corner_plan.hpp"

namespace unflex::rivals {
namespace {

struct Sampled {
  double h;
  std::vector<dynamics::NozzleMotion> p;
};

Sampled sampled(const AxisPath& reference, double h) {
  Sampled result{h, {}};
  PathCursor cursor(reference);
  for (int k = 0; k * h <= end_s(reference) + 1e-9; ++k) {
    result.p.push_back(cursor.at(k * h));
  }
  return result;
}

// All equations as they stand in the header, as residuals of the velocities, without any chain.
Eigen::VectorXd residuals(const Sampled& plan, const dynamics::FlexibleAxis& axis,
                          const Eigen::VectorXd& v, bool velocity_defects_alone) {
  const double h = plan.h;
  const double w2 = axis.main().omega_rad_s * axis.main().omega_rad_s;
  const double c = 2.0 * axis.main().zeta * axis.main().omega_rad_s;
  const auto n = static_cast<int>(plan.p.size());
  std::vector<double> b = {plan.p[0].position};
  for (int k = 0; k + 1 < n; ++k) {
    b.push_back(b.back() + h * (v(k) + v(k + 1)) / 2.0);
  }
  std::vector<double> rows;
  for (int k = 0; k + 1 < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const auto [p1, q1] = plan.p[i];
    const auto [p2, q2] = plan.p[i + 1];
    const double f1 = w2 * (b[i] - p1) + c * (v(k) - q1);
    const double f2 = w2 * (b[i + 1] - p2) + c * (v(k + 1) - q2);
    const double qc = (q1 + q2) / 2.0 + h * (f1 - f2) / 8.0;
    const double pc = (p1 + p2) / 2.0 + h * (q1 - q2) / 8.0;
    const double fc = w2 * ((b[i] + b[i + 1]) / 2.0 - pc) + c * ((v(k) + v(k + 1)) / 2.0 - qc);
    rows.push_back(-3.0 * (q1 - q2) / (2.0 * h) - (f1 + f2) / 4.0 - fc);
    if (!velocity_defects_alone) {
      rows.push_back(-3.0 * (p1 - p2) / (2.0 * h) - (q1 + q2) / 4.0 - qc);
    }
  }
  for (int k = 1; k + 1 < n && !velocity_defects_alone; ++k) {
    rows.push_back(kJerkWeight * (v(k - 1) - 2.0 * v(k) + v(k + 1)) / (h * h));
  }
  if (!velocity_defects_alone) {
    rows.push_back(kStartWeight * v(0));
  }
  return Eigen::Map<Eigen::VectorXd>(rows.data(), static_cast<Eigen::Index>(rows.size()));
}

Eigen::VectorXd velocities(const AxisPath& path) {
  Eigen::VectorXd v(static_cast<Eigen::Index>(path.size()));
  for (Eigen::Index k = 0; k + 1 < v.size(); ++k) {
    v(k) = path[static_cast<std::size_t>(k)].motion.velocity;
  }
  const Parabola& last = path[path.size() - 2];
  v(v.size() - 1) =
      last.motion.velocity + last.motion.acceleration * (path.back().start_s - last.start_s);
  return v;
}

TEST(ThesisMethod, IsTheLeastSquaresPointOfAllItsEquations) {
  for (const auto& [omega, zeta, h] :
       {std::tuple{100.0, 0.5, 5e-3}, {50.0, 0.5, 5e-3}, {100.0, 0.0, 5e-3}, {100.0, 1.0, 1e-2}}) {
    const dynamics::FlexibleAxis axis{omega, zeta};
    const AxisPath reference = reference_path(testing::corner_plan(100.0, 5000.0), gcode::Y);
    const Sampled plan = sampled(reference, h);
    const auto n = static_cast<Eigen::Index>(plan.p.size());
    // The equations are affine: their matrix from the residuals of unit vectors.
    const Eigen::VectorXd rest = residuals(plan, axis, Eigen::VectorXd::Zero(n), false);
    Eigen::MatrixXd matrix(rest.size(), n);
    for (Eigen::Index k = 0; k < n; ++k) {
      matrix.col(k) = residuals(plan, axis, Eigen::VectorXd::Unit(n, k), false) - rest;
    }
    const Eigen::VectorXd expected = matrix.householderQr().solve(-rest);
    const Eigen::VectorXd found = velocities(thesis_least_squares(reference, axis, h));
    ASSERT_EQ(found.size(), n);
    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-6) << omega << ' ' << zeta;
    EXPECT_GT(residuals(plan, axis, found, false).norm(), 1.0) << "no solution of all of them";
  }
}

// 2 · 49 unknowns against 2 · (48 + 48 + 47 + 1) equations, and the base's start in either axis,
// which holds by construction.
TEST(ThesisMethod, HasThreeTimesAsManyEquationsAsUnknowns) {
  const AxisPath reference = reference_path(testing::corner_plan(100.0, 5000.0), gcode::X);
  const Sampled plan = sampled(reference, 5e-3);
  ASSERT_EQ(plan.p.size(), 49U);
  EXPECT_EQ(residuals(plan, {100.0, 0.5}, Eigen::VectorXd::Zero(49), false).size(), 144);
}

TEST(ThesisMethod, MeetsTheVelocityDefectsWhereTheyStandAlone) {
  const dynamics::FlexibleAxis axis{100.0, 0.5};
  const AxisPath reference = reference_path(testing::corner_plan(100.0, 5000.0), gcode::X);
  const Eigen::VectorXd v = velocities(thesis_velocity_defects(reference, axis, 5e-3));
  EXPECT_EQ(v(0), 0.0);
  EXPECT_LT(residuals(sampled(reference, 5e-3), axis, v, true).cwiseAbs().maxCoeff(), 1e-7);
}

// After a jump of the plan's acceleration, the nozzle's acceleration f in the equations alternates
// around the new value with the pole −(3 − ζωh)/(3 + ζωh).
TEST(ThesisMethod, RingsFromNodeToNodeWithThePoleOfItsDefect) {
  constexpr double kOmega = 100.0;
  constexpr double kZeta = 0.2;
  constexpr double kPeriod = 5e-3;
  constexpr double kAccel = 100.0;
  const AxisPath plan = {
      {0.0, {0.0, 0.0, 0.0}}, {0.02, {0.0, 0.0, kAccel}}, {0.2, {1.62, 18.0, 0.0}}};
  const AxisPath base = thesis_velocity_defects(plan, {kOmega, kZeta}, kPeriod);
  PathCursor cursor(plan);
  const double settled = kAccel * (1.0 - std::pow(kOmega * kPeriod, 2) / 12.0);
  std::vector<double> off;
  for (std::size_t k = 0; k < 39; ++k) {
    const dynamics::NozzleMotion p = cursor.at(static_cast<double>(k) * kPeriod);
    off.push_back(kOmega * kOmega * (base[k].motion.position - p.position) +
                  2.0 * kZeta * kOmega * (base[k].motion.velocity - p.velocity) - settled);
  }
  const double pole = -(3.0 - kZeta * kOmega * kPeriod) / (3.0 + kZeta * kOmega * kPeriod);
  EXPECT_NEAR(off[4], -settled, 1e-9);
  for (std::size_t k = 4; k < 38; ++k) {
    EXPECT_NEAR(off[k + 1] / off[k], pole, 1e-9) << k;
  }
}

}  // namespace
}  // namespace unflex::rivals
