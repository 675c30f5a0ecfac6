// The stretches of a window in which limits count.
#include "stretches.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

#include "banded_engine.hpp"
#include "window_makers.hpp"

namespace unflex::compensate {
namespace {

using ::testing::ElementsAre;

// Accelerations within ±1.
struct Accels {
  explicit Accels(std::vector<double> of_nodes) : values(std::move(of_nodes)) {
    bounds[index_of(RowKind::accel)] = RowBounds{{-1.0, 1.0}, {-1.0, 1.0}, {-1.0, 1.0}};
  }
  [[nodiscard]] bool add(std::size_t reach, Stretches& stretches) const {
    PerKind<const double*> rows{};
    rows[index_of(RowKind::accel)] = values.data();
    return add_broken(rows, bounds, values.size(), reach, stretches);
  }

  std::vector<double> values;
  PerKind<std::optional<RowBounds>> bounds;
};

TEST(Stretches, LieAroundWhatIsBroken) {
  std::vector<double> values(20, 0.5);
  values[1] = -1.2;
  values[10] = 1.1;
  values[13] = -1.1;
  Stretches stretches;
  EXPECT_TRUE(Accels(values).add(2, stretches));
  // Those that touch are one.
  EXPECT_THAT(stretches, ElementsAre(NodeRange{0, 3}, NodeRange{8, 15}));
}

TEST(Stretches, GrowByWhatIsBrokenOutsideThemOnly) {
  std::vector<double> values(20, 0.5);
  values[9] = 2.0;
  Stretches stretches = {{8, 12}};
  EXPECT_FALSE(Accels(values).add(2, stretches));
  values[18] = -2.0;
  EXPECT_TRUE(Accels(values).add(3, stretches));
  EXPECT_THAT(stretches, ElementsAre(NodeRange{8, 12}, NodeRange{15, 19}));
}

TEST(Stretches, DoNotBeginForRounding) {
  Stretches stretches;
  EXPECT_FALSE(Accels({1.0, 1.0 + 1e-9, -1.0 - 1e-9}).add(2, stretches));
  EXPECT_TRUE(stretches.empty());
}

TEST(Stretches, AloneHaveBounds) {
  const Accels accels(std::vector<double>(10, 0.0));
  const auto within = bounds_within(accels.bounds, 10, {{2, 4}, {8, 9}});
  const std::vector<Interval>& each = within[index_of(RowKind::accel)]->each;
  ASSERT_EQ(each.size(), 10U);
  for (std::size_t k = 0; k < each.size(); ++k) {
    const bool counts = (k >= 2 && k <= 4) || k >= 8;
    EXPECT_EQ(each[k].upper == 1.0, counts) << k;
    EXPECT_EQ(each[k].lower == -1.0, counts) << k;
  }
  EXPECT_FALSE(within[index_of(RowKind::velocity)]);
}

// A long window that breaks its limit in a few places: the stage form solves it by stretches, the
// flat form as a whole.
TEST(Stretches, LeadToTheOptimumOfTheWholeWindow) {
  std::mt19937_64 random(11);
  for (const double accel_mm_s2 : {12e3, 8e3, 6.5e3, 5.5e3}) {
    AxisWindow window = testing::random_path(random, 2000, {});
    window.limits.max_accel_mm_s2 = accel_mm_s2;
    const auto by_stages = make_banded_engine(BandedForm::stages)->solve(window);
    const auto as_a_whole = make_banded_engine(BandedForm::flat)->solve(window);
    ASSERT_TRUE(by_stages && as_a_whole) << accel_mm_s2;
    EXPECT_GT(by_stages->iterations, 1) << "no limit is broken at " << accel_mm_s2;
    EXPECT_LE(
        testing::largest_difference(by_stages->base.position_mm, as_a_whole->base.position_mm),
        5e-5)
        << accel_mm_s2;
    EXPECT_NEAR(by_stages->objective, as_a_whole->objective, 1e-6 * as_a_whole->objective)
        << accel_mm_s2;
    const auto [least, most] = std::ranges::minmax(by_stages->base.accel_mm_s2);
    EXPECT_LE(std::max(-least, most), accel_mm_s2 * (1.0 + 1e-6));
  }
}

}  // namespace
}  // namespace unflex::compensate
