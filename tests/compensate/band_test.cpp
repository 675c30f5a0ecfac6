// Plants of an axis that is known to some share.
#include "unflex/compensate/band.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

namespace unflex::compensate {
namespace {

const dynamics::FlexibleAxis kAxis{100.0, 0.5};

TEST(Band, OfAnExactAxisHasNoEdges) {
  EXPECT_TRUE(Band{}.is_exact());
  EXPECT_TRUE(edges(kAxis, {}, 1.0).empty());
}

TEST(Band, HasEdgesThatComeOutAlike) {
  const std::vector<Plant> found = edges(kAxis, {.freq_error = 0.1}, 0.9);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_DOUBLE_EQ(found[0].axis.main_rad_s(), 90.0);
  EXPECT_DOUBLE_EQ(found[1].axis.main_rad_s(), 110.0);
  EXPECT_EQ(found[0].axis.main_damping_ratio(), 0.5);
  EXPECT_TRUE(found[0].is_edge && found[1].is_edge);
  // A third of the share stays with the middle, and the slower edge has the larger part.
  EXPECT_NEAR(found[0].share + found[1].share, 0.6, 1e-12);
  EXPECT_NEAR(found[0].share / found[1].share, 11.0 / 9.0, 1e-12);
}

TEST(Band, OfFrequencyAndDampingHasFourCorners) {
  const std::vector<Plant> found = edges(kAxis, {.freq_error = 0.1, .damping_error = 0.2}, 1.0);
  ASSERT_EQ(found.size(), 4U);
  EXPECT_DOUBLE_EQ(found[0].axis.main_damping_ratio(), 0.4);
  EXPECT_DOUBLE_EQ(found[1].axis.main_damping_ratio(), 0.6);
  const double sum =
      std::accumulate(found.begin(), found.end(), 0.0,
                      [](double share, const Plant& plant) { return share + plant.share; });
  EXPECT_NEAR(sum, 2.0 / 3.0, 1e-12);
  const std::vector<Plant> damping = edges(kAxis, {.damping_error = 0.2}, 1.0);
  ASSERT_EQ(damping.size(), 2U);
  EXPECT_EQ(damping[0].axis.main_rad_s(), 100.0);
  EXPECT_DOUBLE_EQ(damping[0].axis.main_damping_ratio(), 0.4);
}

TEST(Band, LeavesAModeAsItIsWhoseDetuningChangesNothing) {
  // For the same acceleration the second mode swings a sixtieth as far as the main one, and the
  // third a third as far.
  const std::vector<dynamics::Mode> modes = {
      {300.0, 0.1, 0.6}, {1000.0, 0.1, 0.1}, {350.0, 0.1, 0.3}};
  const dynamics::FlexibleAxis axis(modes);
  for (const Plant& edge : edges(axis, {.freq_error = 0.1}, 1.0)) {
    const double factor = edge.axis.modes()[0].omega_rad_s / 300.0;
    EXPECT_NEAR(std::abs(factor - 1.0), 0.1, 1e-12);
    EXPECT_EQ(edge.axis.modes()[1].omega_rad_s, 1000.0);
    EXPECT_NEAR(edge.axis.modes()[2].omega_rad_s, factor * 350.0, 1e-9);
  }
}

TEST(Band, HasAModeThatNobodyKnowsOf) {
  const Plant plant = with_unknown_mode(kAxis);
  ASSERT_EQ(plant.axis.mode_count(), 2U);
  EXPECT_FALSE(plant.is_edge);
  EXPECT_EQ(plant.axis.main_rad_s(), 100.0);
  EXPECT_DOUBLE_EQ(plant.axis.modes()[0].gain + plant.axis.modes()[1].gain, 1.0);
  EXPECT_DOUBLE_EQ(plant.axis.fastest_rad_s(), 240.0);
}

}  // namespace
}  // namespace unflex::compensate
