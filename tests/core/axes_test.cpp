#include "unflex/core/axes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "unflex/core/foot.hpp"
#include "unflex/core/xy.hpp"

namespace unflex {
namespace {

TEST(Axes, AreAskedInTheirOrder) {
  std::string order;
  for_each_axis(
      [&](std::string_view letter, int value) {
        order += letter;
        order += value > 0 ? '+' : '-';
      },
      kAxisLetters, Axes<int>{1, -1});
  EXPECT_EQ(order, "X+Y-");
  EXPECT_EQ(map_axes(std::plus{}, Axes<int>{1, 2}, Axes<int>{10, 20}), (Axes<int>{11, 22}));
  EXPECT_TRUE(any_axis(std::identity{}, Axes<bool>{false, true}));
  EXPECT_FALSE(all_axes(std::identity{}, Axes<bool>{false, true}));
  EXPECT_EQ(least_of_axes(std::identity{}, Axes<int>{3, -4}), -4);
  EXPECT_EQ(most_of_axes(std::identity{}, Axes<int>{3, -4}), 3);
  EXPECT_EQ(sum_of_axes(std::identity{}, Axes<int>{3, -4}), -1);
}

TEST(XY, IsAVectorInThePlane) {
  const XY a{3.0, 4.0};
  const XY b{-1.0, 2.0};
  EXPECT_EQ(a + b, (XY{2.0, 6.0}));
  EXPECT_EQ(a - b, (XY{4.0, 2.0}));
  EXPECT_EQ(2.0 * a, (XY{6.0, 8.0}));
  EXPECT_EQ(dot(a, b), 5.0);
  EXPECT_EQ(cross(a, b), 10.0);
  EXPECT_EQ(length(a), 5.0);
  EXPECT_EQ(distance(a, a + a), 5.0);
  EXPECT_EQ(taxicab(b), 3.0);
  EXPECT_EQ(largest_part(b), 2.0);
  EXPECT_EQ(turned_left(a), (XY{-4.0, 3.0}));
  EXPECT_EQ(dot(a, turned_left(a)), 0.0);
  std::vector<double> position = {7.0, 8.0, 9.0};
  EXPECT_EQ(xy_of(position), (XY{7.0, 8.0}));
  set_xy(position, b);
  EXPECT_EQ(position, (std::vector<double>{-1.0, 2.0, 9.0}));
}

// No other place of the way is nearer.
TEST(Foot, IsTheNearestPlaceOfAWay) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> any(-5.0, 5.0);
  for (int i = 0; i < 500; ++i) {
    const double angle = any(random);
    const XY direction{std::cos(angle), std::sin(angle)};
    const double length_mm = std::abs(any(random));
    const XY p{any(random), any(random)};
    const Foot foot = foot_on(p, direction, length_mm);
    double least = squared(p);
    for (int k = 0; k <= 1000; ++k) {
      least = std::min(least, squared(p - (k * 1e-3 * length_mm) * direction));
    }
    EXPECT_LE(foot.distance2_mm2, least + 1e-12);
    EXPECT_NEAR(foot.distance2_mm2, least, 1e-4);
    EXPECT_GE(foot.along_mm, 0.0);
    EXPECT_LE(foot.along_mm, length_mm);
  }
}

// With a direction that is twice as long, the place is half as far along.
TEST(Foot, TakesADirectionOfAnyLength) {
  const XY direction{2.0, 0.0};
  const Foot foot = foot_on({3.0, 1.0}, direction, 10.0, 0.25);
  EXPECT_EQ(foot.along_mm, 1.5);
  EXPECT_EQ(foot.distance2_mm2, 1.0);
}

}  // namespace
}  // namespace unflex
