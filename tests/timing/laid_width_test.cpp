#include "laid_width.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

namespace unflex::timing {
namespace {

constexpr double kPeriod_s = 1.5e-3;
constexpr double kPerMm = 0.035;  // filament per mm of way

Extruder extruder_of(double advance_s, double max_accel_mm_s2) {
  return {.hotend = {.advance_s = advance_s},
          .max_accel_mm_s2 = max_accel_mm_s2,
          .width_tolerance = 0.1};
}

// A nozzle of 100 mm/s that slows down to 20 mm/s and back, each within `change_s`, every 0.2 s.
std::vector<double> way_of(double change_s) {
  const auto speed_mm_s = [&](double t) {
    const double away_s = std::abs(std::remainder(t - 0.1, 0.2));
    const double share = std::clamp(away_s / change_s, 0.0, 1.0);
    return 60.0 - 40.0 * std::cos(std::numbers::pi * share);
  };
  std::vector<double> way_mm = {0.0};
  for (double t = 0.5 * kPeriod_s; t < 1.0; t += kPeriod_s) {
    way_mm.push_back(way_mm.back() + kPeriod_s * speed_mm_s(t));
  }
  return way_mm;
}

std::vector<double> times(std::vector<double> values, double factor) {
  for (double& value : values) {
    value *= factor;
  }
  return values;
}

// The largest error far from where the motion begins and ends, which it does at full speed.
double worst(const std::vector<double>& way_mm, const Extruder& extruder) {
  const std::vector<double> errors =
      width_errors(times(way_mm, kPerMm), way_mm, kPeriod_s, extruder);
  const auto away = std::ssize(errors) / 5;
  return *std::max_element(errors.begin() + away, errors.end() - away);
}

// The filament of this motion accelerates by at most K q̈ ≈ K A_w Δv (π/change)²/2.
TEST(LaidWidth, IsRightWhereTheExtruderFollows) {
  constexpr double kAdvance_s = 0.4;
  constexpr double kChange_s = 0.04;
  const double needed_mm_s2 =
      kAdvance_s * kPerMm * 40.0 * std::pow(std::numbers::pi / kChange_s, 2);
  const std::vector<double> way_mm = way_of(kChange_s);
  const double followed = worst(way_mm, extruder_of(kAdvance_s, 1.1 * needed_mm_s2));
  EXPECT_LT(followed, 2e-3);
  EXPECT_GT(worst(way_mm, extruder_of(kAdvance_s, 0.5 * needed_mm_s2)), 10.0 * followed);
}

TEST(LaidWidth, IsWorseTheLessTheExtruderAccelerates) {
  const std::vector<double> way_mm = way_of(0.01);
  double last = 0.0;
  for (const double accel_mm_s2 : {40000.0, 20000.0, 10000.0, 5000.0, 2500.0}) {
    const double error = worst(way_mm, extruder_of(0.4, accel_mm_s2));
    EXPECT_GT(error, 1.1 * last) << accel_mm_s2;
    last = error;
  }
}

// Only the shape of the flow counts.
TEST(LaidWidth, IsAShareOfWhatIsAskedFor) {
  const std::vector<double> way_mm = way_of(0.015);
  const std::vector<double> thin =
      width_errors(times(way_mm, kPerMm), way_mm, kPeriod_s, extruder_of(0.3, 6000.0));
  const std::vector<double> thick =
      width_errors(times(way_mm, 2.0 * kPerMm), way_mm, kPeriod_s, extruder_of(0.3, 12000.0));
  ASSERT_EQ(thin.size(), way_mm.size());
  for (std::size_t i = 0; i < thin.size(); ++i) {
    EXPECT_NEAR(thick[i], thin[i], 0.02 * std::ranges::max(thin));
  }
}

// The time between two values does not matter.
TEST(LaidWidth, DoesNotDependOnTheNodes) {
  const std::vector<double> fine_mm = way_of(0.015);
  std::vector<double> coarse_mm;
  for (std::size_t i = 0; i < fine_mm.size(); i += 2) {
    coarse_mm.push_back(fine_mm[i]);
  }
  const Extruder extruder = extruder_of(0.4, 8000.0);
  const double fine =
      std::ranges::max(width_errors(times(fine_mm, kPerMm), fine_mm, kPeriod_s, extruder));
  const double coarse = std::ranges::max(
      width_errors(times(coarse_mm, kPerMm), coarse_mm, 2.0 * kPeriod_s, extruder));
  EXPECT_NEAR(coarse, fine, 0.15 * fine);
}

TEST(LaidWidth, TakesTheSlopeOfANonlinearHotend) {
  const std::vector<double> way_mm = way_of(0.015);
  Extruder bent = extruder_of(0.1, 3000.0);
  bent.hotend.shape = dynamics::PressureShape::two_slopes;
  bent.hotend.second_advance_s = 0.1;
  bent.hotend.knee_mm_s = 1.0;
  EXPECT_EQ(worst(way_mm, bent), worst(way_mm, extruder_of(0.1, 3000.0)));
  bent.hotend.second_advance_s = 0.3;
  EXPECT_GT(worst(way_mm, bent), worst(way_mm, extruder_of(0.1, 3000.0)));
}

// Where nothing is laid, and near the ends of what is, the width says nothing.
TEST(LaidWidth, HasNoErrorInTravel) {
  const std::vector<double> way_mm = way_of(0.01);
  std::vector<double> laid_mm;
  for (const double way : way_mm) {
    laid_mm.push_back(kPerMm * (std::min(way, 20.0) + std::max(way - 50.0, 0.0)));
  }
  const std::vector<double> errors =
      width_errors(laid_mm, way_mm, kPeriod_s, extruder_of(0.4, 2000.0));
  EXPECT_GT(std::ranges::max(errors), 0.01);
  for (std::size_t i = 0; i < errors.size(); ++i) {
    if (way_mm[i] > 19.5 && way_mm[i] < 50.5) {
      EXPECT_EQ(errors[i], 0.0) << way_mm[i];
    }
  }
}

TEST(LaidWidth, HoldsForShortMotion) {
  for (const std::size_t count : {0, 1, 2, 3, 4, 5, 6}) {
    std::vector<double> way_mm;
    for (std::size_t i = 0; i < count; ++i) {
      way_mm.push_back(static_cast<double>(i));
    }
    const std::vector<double> errors =
        width_errors(way_mm, way_mm, kPeriod_s, extruder_of(0.4, 1.0));
    ASSERT_EQ(errors.size(), count);
    for (const double error : errors) {
      EXPECT_TRUE(std::isfinite(error));
    }
  }
}

}  // namespace
}  // namespace unflex::timing
