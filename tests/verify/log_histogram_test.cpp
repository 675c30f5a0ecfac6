#include "unflex/verify/log_histogram.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace unflex::verify {
namespace {

TEST(LogHistogram, OfNothingHasNoQuantiles) { EXPECT_EQ(LogHistogram{}.quantile(0.5), 0.0); }

TEST(LogHistogram, FindsQuantilesWithinHalfAPercent) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> exponent(-8.9, 1.9);
  std::vector<double> values;
  LogHistogram histogram;
  for (int i = 0; i < 10001; ++i) {
    values.push_back(std::pow(10.0, exponent(random)));
    histogram.add_square(values.back() * values.back(), 0.25);
  }
  std::ranges::sort(values);
  for (const double fraction : {0.01, 0.1, 0.5, 0.99, 0.999}) {
    const double exact = values[static_cast<std::size_t>(std::ceil(fraction * 10001.0)) - 1];
    EXPECT_NEAR(histogram.quantile(fraction), exact, 3e-3 * exact) << fraction;
  }
}

TEST(LogHistogram, WeighsValues) {
  LogHistogram histogram;
  histogram.add_square(1.0, 3.0);
  histogram.add_square(100.0, 1.0);
  EXPECT_NEAR(histogram.quantile(0.75), 1.0, 1e-2);
  EXPECT_NEAR(histogram.quantile(0.76), 10.0, 0.1);
}

TEST(LogHistogram, TakesWhatLiesOutside) {
  LogHistogram histogram;
  for (const double square : {0.0, 1e-30, 1e30, std::numeric_limits<double>::infinity()}) {
    histogram.add_square(square, 1.0);
  }
  EXPECT_NEAR(histogram.quantile(0.5), 0x1p-30, 0x1p-36);
  EXPECT_NEAR(histogram.quantile(1.0), 128.0, 1.0);
}

TEST(LogHistogram, KnowsTheWeightBelowAValue) {
  LogHistogram histogram;
  EXPECT_EQ(histogram.weight_below(1.0), 0.0);
  histogram.add_square(0.0, 1.0);
  histogram.add_square(0.25, 2.0);
  histogram.add_square(100.0, 4.0);
  EXPECT_EQ(histogram.weight_below(0.49), 1.0);
  EXPECT_EQ(histogram.weight_below(0.51), 3.0);
  EXPECT_EQ(histogram.weight_below(std::numeric_limits<double>::infinity()), 7.0);
}

}  // namespace
}  // namespace unflex::verify
