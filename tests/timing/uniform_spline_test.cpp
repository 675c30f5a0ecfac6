#include "uniform_spline.hpp"

#include <gtest/gtest.h>

#include <type_traits>
#include <vector>

namespace unflex::timing {
namespace {

constexpr double kPlaces[] = {0.0, 0.1, 0.25, 0.5, 0.7, 0.99, 1.0};

template <typename Degree>
class UniformSpline : public ::testing::Test {
 protected:
  static constexpr int kDegree = Degree::value;

  // The j-th derivative between node k and the next.
  static double value(const std::vector<double>& points, std::size_t k, double x, int j) {
    const SplineShares<kDegree> shares = spline_shares<kDegree>(x);
    double sum = 0.0;
    for (int i = 0; i <= kDegree; ++i) {
      sum += shares[j][i] * points[k + i];
    }
    return sum;
  }
};

using Degrees = ::testing::Types<std::integral_constant<int, 5>, std::integral_constant<int, 7>>;
TYPED_TEST_SUITE(UniformSpline, Degrees, );

TYPED_TEST(UniformSpline, SharesAddUpToOneAndThoseOfDerivativesToNothing) {
  constexpr int D = TestFixture::kDegree;
  const std::vector<double> ones(D + 1, 1.0);
  for (const double x : kPlaces) {
    for (int j = 0; j < D; ++j) {
      EXPECT_NEAR(this->value(ones, 0, x, j), j == 0 ? 1.0 : 0.0, 1e-13) << x << ' ' << j;
    }
    const SplineShares<D> shares = spline_shares<D>(x);
    for (const double share : shares[0]) {
      EXPECT_GE(share, 0.0) << x;
    }
  }
}

TYPED_TEST(UniformSpline, IsALineWherePointsStandForNodesOnALine) {
  constexpr int D = TestFixture::kDegree;
  constexpr int kAhead = (D - 1) / 2;
  constexpr std::size_t kPeriods = 4;
  std::vector<double> points;
  for (int j = 0; j < static_cast<int>(kPeriods) + D; ++j) {
    points.push_back(3.0 - 2.0 * (j - kAhead));
  }
  for (std::size_t k = 0; k < kPeriods; ++k) {
    for (const double x : kPlaces) {
      EXPECT_NEAR(this->value(points, k, x, 0), 3.0 - 2.0 * (static_cast<double>(k) + x), 1e-12);
      EXPECT_NEAR(this->value(points, k, x, 1), -2.0, 1e-12);
      for (int j = 2; j < D; ++j) {
        EXPECT_NEAR(this->value(points, k, x, j), 0.0, 1e-11) << j;
      }
    }
  }
}

TYPED_TEST(UniformSpline, DerivativesAreTheSlopesOfTheSharesBefore) {
  constexpr int D = TestFixture::kDegree;
  constexpr double kStep = 1e-4;
  for (const double x : {0.1, 0.35, 0.5, 0.8}) {
    const SplineShares<D> before = spline_shares<D>(x - kStep);
    const SplineShares<D> at = spline_shares<D>(x);
    const SplineShares<D> after = spline_shares<D>(x + kStep);
    for (int j = 0; j + 1 < D; ++j) {
      for (int i = 0; i <= D; ++i) {
        EXPECT_NEAR(at[j + 1][i], (after[j][i] - before[j][i]) / (2.0 * kStep), 1e-6)
            << x << ' ' << j << ' ' << i;
      }
    }
  }
}

TYPED_TEST(UniformSpline, GoesOnAtNodes) {
  constexpr int D = TestFixture::kDegree;
  const SplineShares<D> before = spline_shares<D>(1.0);
  const SplineShares<D> after = spline_shares<D>(0.0);
  for (int j = 0; j < D; ++j) {
    // The next period begins with the next point.
    EXPECT_NEAR(before[j][0], 0.0, 1e-13) << j;
    EXPECT_NEAR(after[j][D], 0.0, 1e-13) << j;
    for (int i = 0; i < D; ++i) {
      EXPECT_NEAR(before[j][i + 1], after[j][i], 1e-13) << j << ' ' << i;
    }
  }
}

}  // namespace
}  // namespace unflex::timing
