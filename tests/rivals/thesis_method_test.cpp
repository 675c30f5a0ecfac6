#include "unflex/rivals/thesis_method.hpp"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
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

constexpr double kStartWeight = 1e9;

// All equations of an axis as they stand in the header, as residuals of the base's positions,
// without any chain.
Eigen::VectorXd residuals(const Sampled& plan, const dynamics::FlexibleAxis& axis,
                          const Eigen::VectorXd& b, double max_accel) {
  const double h = plan.h;
  const double w2 = axis.main().omega_rad_s * axis.main().omega_rad_s;
  const double c = 2.0 * axis.main().zeta * axis.main().omega_rad_s;
  std::vector<double> rows = {kStartWeight * (b(0) - plan.p[0].position)};
  double v1 = 0.0;
  double a1 = 0.0;
  for (int k = 0; k + 1 < b.size(); ++k) {
    const double a2 = 2.0 * ((b(k + 1) - b(k)) / h - v1) / h;
    const double v2 = v1 + a2 * h;
    const auto i = static_cast<std::size_t>(k);
    const auto [p1, q1] = plan.p[i];
    const auto [p2, q2] = plan.p[i + 1];
    const double f1 = w2 * (b(k) - p1) + c * (v1 - q1);
    const double f2 = w2 * (b(k + 1) - p2) + c * (v2 - q2);
    const double qc = (q1 + q2) / 2.0 + h * (f1 - f2) / 8.0;
    const double pc = (p1 + p2) / 2.0 + h * (q1 - q2) / 8.0;
    const double fc = w2 * ((b(k) + b(k + 1)) / 2.0 - pc) + c * ((v1 + v2) / 2.0 - qc);
    rows.push_back(-3.0 * (q1 - q2) / (2.0 * h) - (f1 + f2) / 4.0 - fc);
    rows.push_back(-3.0 * (p1 - p2) / (2.0 * h) - (q1 + q2) / 4.0 - qc);
    rows.push_back(kJerkWeight * std::max(0.0, std::abs(a2 - a1) / h - max_accel / h));
    v1 = v2;
    a1 = a2;
  }
  return Eigen::Map<Eigen::VectorXd>(rows.data(), static_cast<Eigen::Index>(rows.size()));
}

Eigen::VectorXd positions(const AxisPath& path) {
  Eigen::VectorXd b(static_cast<Eigen::Index>(path.size()));
  for (Eigen::Index k = 0; k < b.size(); ++k) {
    b(k) = path[static_cast<std::size_t>(k)].motion.position;
  }
  return b;
}

struct PrinterCase {
  double omega_rad_s;
  double zeta;
  double accel_mm_s2;
  double velocity_mm_s;
  double period_s;
};

// ref 1A 1B 2A 2B 3A 3B 4A 4B 5A 5B.
constexpr std::array<PrinterCase, 11> kCases = {{{100.0, 0.5, 5000.0, 100.0, 5e-3},
                                                 {50.0, 0.5, 5000.0, 100.0, 5e-3},
                                                 {200.0, 0.5, 5000.0, 100.0, 5e-3},
                                                 {100.0, 0.0, 5000.0, 100.0, 5e-3},
                                                 {100.0, 1.0, 5000.0, 100.0, 5e-3},
                                                 {100.0, 0.5, 1000.0, 100.0, 5e-3},
                                                 {100.0, 0.5, 10000.0, 100.0, 5e-3},
                                                 {100.0, 0.5, 5000.0, 50.0, 5e-3},
                                                 {100.0, 0.5, 5000.0, 200.0, 5e-3},
                                                 {100.0, 0.5, 5000.0, 100.0, 10e-3},
                                                 {100.0, 0.5, 5000.0, 100.0, 1e-3}}};

// The sum of squares is convex, and a point from which a Gauss–Newton step does not move is its
// least one.
TEST(ThesisMethod, IsTheLeastSquaresPointOfAllItsEquations) {
  constexpr double kDifferenceMm = 1e-6;
  for (std::size_t i = 0; i < kCases.size(); ++i) {
    const PrinterCase& of = kCases[i];
    const dynamics::FlexibleAxis axis{of.omega_rad_s, of.zeta};
    const auto corner = testing::corner_plan(of.velocity_mm_s, of.accel_mm_s2);
    for (const gcode::Axis letter : {gcode::X, gcode::Y}) {
      const AxisPath reference = reference_path(corner, letter);
      const Sampled plan = sampled(reference, of.period_s);
      const Eigen::VectorXd found =
          positions(thesis_least_squares(reference, axis, of.period_s, of.accel_mm_s2).path);
      ASSERT_EQ(found.size(), static_cast<Eigen::Index>(plan.p.size()));
      const Eigen::VectorXd rows = residuals(plan, axis, found, of.accel_mm_s2);
      // Away from the rows' bends the quotient is exact.
      Eigen::MatrixXd jacobian(rows.size(), found.size());
      for (Eigen::Index k = 0; k < found.size(); ++k) {
        const Eigen::VectorXd moved =
            found + kDifferenceMm * Eigen::VectorXd::Unit(found.size(), k);
        jacobian.col(k) = (residuals(plan, axis, moved, of.accel_mm_s2) - rows) / kDifferenceMm;
      }
      const Eigen::VectorXd step = jacobian.householderQr().solve(rows);
      EXPECT_LT(step.cwiseAbs().maxCoeff(), 1e-8) << i;
      EXPECT_GT(rows.norm(), 1.0) << "no solution of all of them";
    }
  }
}

TEST(ThesisMethod, HasTheNodesOfTheThesis) {
  constexpr std::array<std::size_t, 11> kNodes = {49, 49, 49, 49, 49, 81, 45, 85, 37, 25, 241};
  for (std::size_t i = 0; i < kCases.size(); ++i) {
    const PrinterCase& of = kCases[i];
    const SolvedPath base = thesis_least_squares(
        reference_path(testing::corner_plan(of.velocity_mm_s, of.accel_mm_s2), gcode::X),
        {of.omega_rad_s, of.zeta}, of.period_s, of.accel_mm_s2);
    EXPECT_EQ(base.path.size(), kNodes[i]) << i;
    EXPECT_EQ(base.size.unknowns, kNodes[i]) << i;
    EXPECT_EQ(base.size.equations, 3 * kNodes[i] - 2) << i;
    EXPECT_GT(base.iterations, 1) << i;
  }
}

TEST(ThesisMethod, Has98UnknownsAgainst290Rows) {
  const auto corner = testing::corner_plan(100.0, 5000.0);
  Eigen::Index unknowns = 0;
  Eigen::Index rows = 0;
  ProblemSize told;
  for (const gcode::Axis letter : {gcode::X, gcode::Y}) {
    const AxisPath reference = reference_path(corner, letter);
    told.add(thesis_least_squares(reference, {100.0, 0.5}, 5e-3, 5000.0).size);
    const Sampled plan = sampled(reference, 5e-3);
    const Eigen::VectorXd b = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(plan.p.size()));
    unknowns += b.size();
    rows += residuals(plan, {100.0, 0.5}, b, 5000.0).size();
  }
  EXPECT_EQ(unknowns, 98);
  EXPECT_EQ(rows, 290);
  EXPECT_EQ(told.unknowns, 98U);
  EXPECT_EQ(told.equations, 290U);
}

// The jerk rows are one-sided: below the limit they ask for nothing.
TEST(ThesisMethod, IgnoresAJerkBelowItsLimit) {
  const dynamics::FlexibleAxis axis{100.0, 0.5};
  const AxisPath reference = reference_path(testing::corner_plan(100.0, 5000.0), gcode::X);
  const auto base = [&](double max_accel) {
    return positions(thesis_least_squares(reference, axis, 5e-3, max_accel).path);
  };
  EXPECT_EQ(thesis_least_squares(reference, axis, 5e-3, 1e6).iterations, 1);
  EXPECT_EQ(base(1e6), base(2e6));
  EXPECT_GT((base(1e6) - base(5000.0)).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(ThesisMethod, MeetsTheVelocityDefectsWhereTheyStandAlone) {
  const dynamics::FlexibleAxis axis{100.0, 0.5};
  const AxisPath reference = reference_path(testing::corner_plan(100.0, 5000.0), gcode::X);
  const AxisPath base = thesis_velocity_defects(reference, axis, 5e-3).path;
  EXPECT_EQ(base.front().motion.velocity, 0.0);
  const Eigen::VectorXd rows = residuals(sampled(reference, 5e-3), axis, positions(base), 5000.0);
  for (Eigen::Index row = 1; row < rows.size(); row += 3) {
    EXPECT_LT(std::abs(rows(row)), 1e-7) << row;
  }
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
  const AxisPath base = thesis_velocity_defects(plan, {kOmega, kZeta}, kPeriod).path;
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
