#include "banded_ldlt.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

namespace unflex::compensate {
namespace {

TEST(BandedLdlt, SolvesWhatADenseFactorSolves) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  for (std::size_t size = 5; size <= 40; ++size) {
    constexpr std::size_t kFirst = 3;
    BandMatrix band;
    for (Padded& diagonal : band) {
      diagonal.resize(size + 7);
      for (std::size_t i = 0; i < size + 7; ++i) {
        diagonal[i] = uniform(random);  // also outside of the rows asked for
      }
    }
    const auto n = static_cast<Eigen::Index>(size);
    Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
    for (std::size_t r = 0; r < size; ++r) {
      band[0][kFirst + r] += 7.0;
      for (std::size_t d = 0; d <= kHalfBand && r + d < size; ++d) {
        const auto i = static_cast<Eigen::Index>(r);
        const auto j = static_cast<Eigen::Index>(r + d);
        dense(i, j) = dense(j, i) = band[d][kFirst + r];
      }
    }
    BandedLdlt ldlt;
    ASSERT_TRUE(ldlt.factor(band, kFirst, kFirst + size - 1));
    Eigen::VectorXd x = Eigen::VectorXd::Random(n + 7);
    const Eigen::VectorXd right = x;
    ldlt.solve(x.data());
    const Eigen::VectorXd expected = dense.llt().solve(right.segment(kFirst, n));
    EXPECT_LT((x.segment(kFirst, n) - expected).lpNorm<Eigen::Infinity>(), 1e-14) << size;
    EXPECT_EQ(x.head(kFirst), right.head(kFirst));
    EXPECT_EQ(x.tail(7 - kFirst), right.tail(7 - kFirst));
  }
}

TEST(BandedLdlt, RefusesWhatIsNotPositiveDefinite) {
  for (const std::size_t bad : {0U, 3U, 10U, 11U, 15U, 20U}) {
    BandMatrix band;
    for (Padded& diagonal : band) {
      diagonal.resize(21);
      as_array(diagonal).setConstant(0.1);
    }
    as_array(band[0]).setConstant(2.0);
    BandedLdlt ldlt;
    EXPECT_TRUE(ldlt.factor(band, 0, 20));
    band[0][bad] = -1.0;
    EXPECT_FALSE(ldlt.factor(band, 0, 20)) << bad;
    band[0][bad] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(ldlt.factor(band, 0, 20)) << bad;
  }
}

}  // namespace
}  // namespace unflex::compensate
