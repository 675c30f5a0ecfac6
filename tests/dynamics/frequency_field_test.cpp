#include "unflex/dynamics/frequency_field.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "unflex/dynamics/node_map.hpp"

namespace unflex::dynamics {
namespace {

TEST(SharesAlong, AreLinearBetweenPlacesAndConstantBeyondThem) {
  const SharesAlong shares{{10.0, 20.0, 40.0}, {1.0, 0.8, 1.2}};
  EXPECT_EQ(shares.at(-5.0), 1.0);
  EXPECT_EQ(shares.at(10.0), 1.0);
  EXPECT_NEAR(shares.at(15.0), 0.9, 1e-15);
  EXPECT_NEAR(shares.at(20.0), 0.8, 1e-15);
  EXPECT_NEAR(shares.at(35.0), 1.1, 1e-15);
  EXPECT_EQ(shares.at(40.0), 1.2);
  EXPECT_EQ(shares.at(99.0), 1.2);
  EXPECT_EQ(SharesAlong{}.at(3.0), 1.0);
}

TEST(AFrequencyField, IsTheProductAlongBothAxes) {
  FrequencyField field;
  EXPECT_TRUE(field.is_even());
  EXPECT_EQ(field.at({7.0, -7.0}), 1.0);
  field.x = {{0.0, 100.0}, {1.0, 0.8}};
  field.y = {{0.0, 100.0}, {1.0, 1.5}};
  EXPECT_FALSE(field.is_even());
  EXPECT_NEAR(field.at({50.0, 100.0}), 0.9 * 1.5, 1e-15);
}

// Where the field is constant beyond its last place, the map is that of an axis with these
// frequencies.
TEST(FieldMaps, StepAsAnAxisWithTheFrequenciesOfThePlace) {
  const FlexibleAxis axis = from_frequency(45.0, 0.06);
  FrequencyField field;
  field.x = {{0.0, 100.0}, {1.0, 0.9}};
  FieldMaps<ExactMap> maps(axis, field, 1e-3);
  for (const double x_mm : {0.0, 30.0, 64.0, 100.0, 30.0, 200.0}) {
    NozzleState by_maps = axis.riding(0.1);
    maps.at({x_mm, 5.0}).advance({0.0, 3.0, 2000.0}, by_maps);
    const NozzleState exact =
        exact_step(axis.detuned(field.at({x_mm, 5.0})), axis.riding(0.1), {0.0, 3.0, 2000.0}, 1e-3);
    EXPECT_NEAR(by_maps.position(), exact.position(), 1e-6) << x_mm;
    EXPECT_NEAR(by_maps.velocity(), exact.velocity(), 5e-3) << x_mm;
  }
}

}  // namespace
}  // namespace unflex::dynamics
