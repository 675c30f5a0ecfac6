#include "place_gauge.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace unflex::verify {
namespace {

TEST(PlaceGauge, HasAnErrorForEachSquareAndEachBand) {
  PlaceGauge gauge;
  gauge.add({5.0, 5.0}, 0.2, 9e-6, 1.0);
  gauge.add({19.9, 0.1}, 0.4, 1e-6, 3.0);
  gauge.add({-0.1, 25.0}, 7.3, 4e-6, 2.0);
  const PlaceErrors errors = gauge.errors();
  ASSERT_EQ(errors.squares.size(), 2U);
  EXPECT_EQ(errors.squares[0].x_mm, 10.0);
  EXPECT_EQ(errors.squares[0].y_mm, 10.0);
  EXPECT_DOUBLE_EQ(errors.squares[0].error.rms_mm, std::sqrt(12e-6 / 4.0));
  EXPECT_EQ(errors.squares[0].error.duration_s, 4.0);
  EXPECT_EQ(errors.squares[1].x_mm, -10.0);
  EXPECT_EQ(errors.squares[1].y_mm, 30.0);
  EXPECT_DOUBLE_EQ(errors.squares[1].error.rms_mm, 2e-3);
  ASSERT_EQ(errors.bands.size(), 2U);
  EXPECT_EQ(errors.bands[0].from_mm, 0.0);
  EXPECT_EQ(errors.bands[1].from_mm, 7.0);
  EXPECT_DOUBLE_EQ(errors.bands[1].error.rms_mm, 2e-3);
}

}  // namespace
}  // namespace unflex::verify
