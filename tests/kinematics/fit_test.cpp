#include "unflex/kinematics/fit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "checks.hpp"
#include "unflex/kinematics/tripteron.hpp"

namespace unflex::kinematics {
namespace {

using testing::HasSubstr;

const Matrix kRows = {{{1.0, 1.0, -1.414214}, {1.0, -0.98, -1.02}, {1.01, 0.0, 1.0}}};
const Joints kOffset = {-85.0, -90.0, 230.0};

// The corners of a cube with edges of 200 mm, measured with a normal error.
std::vector<Pair> corners(double noise_mm, unsigned seed = 5) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  std::vector<Pair> pairs;
  for (int k = 0; k < 8; ++k) {
    const Point p = {(k & 1) != 0 ? 200.0 : 0.0, (k & 2) != 0 ? 200.0 : 0.0,
                     (k & 4) != 0 ? 200.0 : 0.0};
    Joints q = *to_joints(Linear{Motors(kRows), kOffset}, p);
    for (double& joint : q) {
      joint += noise_mm * noise(random);
    }
    pairs.push_back({q, p});
  }
  return pairs;
}

TEST(AFit, FindsRowsAndOffset) {
  const Result<Fit> found = fit(corners(0.0));
  ASSERT_TRUE(found);
  for (std::size_t i = 0; i < 3; ++i) {
    expect_near(found->rows[i], kRows[i], 1e-12);
    EXPECT_LT(found->rms_mm[i], 1e-12);
  }
  expect_near(found->offset_mm, kOffset, 1e-10);
  EXPECT_EQ(found->residuals_mm.size(), 8U);
}

TEST(AFit, IsHardlyDisturbedByNoise) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const Result<Fit> found = fit(corners(0.05, seed));
    ASSERT_TRUE(found);
    for (std::size_t i = 0; i < 3; ++i) {
      expect_near(found->rows[i], kRows[i], 0.002);
      EXPECT_LT(found->rms_mm[i], 0.1);
    }
  }
}

TEST(AFit, HasResidualsAcrossWhatItFits) {
  const std::vector<Pair> pairs = corners(0.05);
  const Result<Fit> found = fit(pairs);
  ASSERT_TRUE(found);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const Joints told = *to_joints(Linear{Motors(found->rows), found->offset_mm}, pairs[k].p_mm);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(found->residuals_mm[k][i], pairs[k].q_mm[i] - told[i], 1e-9);
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    double sum = 0.0;
    double sum_x = 0.0;
    double largest = 0.0;
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      sum += found->residuals_mm[k][i];
      sum_x += found->residuals_mm[k][i] * pairs[k].p_mm[0];
      largest = std::max(largest, std::abs(found->residuals_mm[k][i]));
    }
    EXPECT_NEAR(sum, 0.0, 1e-9);
    EXPECT_NEAR(sum_x, 0.0, 1e-7);
    EXPECT_DOUBLE_EQ(found->largest_mm[i], largest);
  }
}

TEST(AFit, NamesTheRowThatIsOff) {
  std::vector<Pair> pairs = corners(0.02);
  pairs[3].q_mm[1] += 2.0;
  const Result<Fit> found = fit(pairs);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->worst_row, 1U);
  EXPECT_GT(found->rms_mm[1], 10.0 * found->rms_mm[0]);
}

TEST(AFit, NeedsFourPlacesThatAreNotInAPlane) {
  std::vector<Pair> pairs = corners(0.0);
  pairs.resize(3);
  const Result<Fit> few = fit(pairs);
  ASSERT_FALSE(few);
  EXPECT_THAT(few.error().message,
              HasSubstr("at least 4 places that are not in one plane are needed, and it has 3"));
  pairs = corners(0.05);
  pairs.resize(4);  // z is 0
  const Result<Fit> flat = fit(pairs);
  ASSERT_FALSE(flat);
  EXPECT_THAT(flat.error().message, HasSubstr("lie in a plane"));
  for (Pair& pair : pairs) {
    pair.p_mm = {50.0, 20.0, 10.0};
  }
  EXPECT_FALSE(fit(pairs)) << "all at one place";
  const std::vector<Pair> all = corners(0.0);
  EXPECT_TRUE(fit(std::vector{all[0], all[1], all[2], all[4]}));
}

TEST(AFit, RefusesRowsThatNoMachineHas) {
  std::vector<Pair> pairs = corners(0.0);
  for (Pair& pair : pairs) {
    pair.q_mm[1] = pair.q_mm[0];
  }
  const Result<Fit> found = fit(pairs);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("no machine can have the rows"));
}

}  // namespace
}  // namespace unflex::kinematics
