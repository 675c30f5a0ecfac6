#include "unflex/planner/printer_shaper.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace unflex::planner {
namespace {

FirmwareConfig config_of(Firmware firmware) {
  FirmwareConfig config;
  config.firmware = firmware;
  switch (firmware) {
    case Firmware::marlin:
      config.shaper = {"zv", "zv", 0.15, 0.15};
      break;
    case Firmware::rrf:
      config.shaper = {"zvd", "zvd", 0.1, 0.1};
      break;
    case Firmware::klipper:
      break;
  }
  return config;
}

gcode::Shaper shaper_of(double x_hz, double y_hz) {
  gcode::Shaper shaper;
  shaper.freq_hz = {x_hz, y_hz};
  return shaper;
}

double damped_period_s(double freq_hz, double zeta) {
  return 1.0 / (freq_hz * std::sqrt(1.0 - zeta * zeta));
}

const gcode::Shaper kOff = shaper_of(0.0, 0.0);
const gcode::Shaper kOn = shaper_of(45.0, 45.0);

TEST(Shaping, LeavesAnAxisAloneWhoseFrequencyIsZero) {
  const Shaping one = shaping(config_of(Firmware::klipper), shaper_of(45.0, 0.0));
  EXPECT_EQ(one.x.size(), 3U);
  EXPECT_TRUE(one.y.empty());
  EXPECT_TRUE(one.acts());
  const Shaping none = shaping(config_of(Firmware::klipper), kOff);
  EXPECT_FALSE(none.acts());
  EXPECT_DOUBLE_EQ(none.reach_s(), 0.0);
  EXPECT_DOUBLE_EQ(none.length_s(), 0.0);
}

// The weights of kin_shaper.c for mzv of 45 Hz and the default damping ratio, their times shifted
// so that their weighted mean is 0.
TEST(Shaping, ReachesAsFarAsKlipperSays) {
  const Shaping mzv = shaping(config_of(Firmware::klipper), kOn);
  EXPECT_NEAR(mzv.reach_s(), 0.009528, 1e-6);
  EXPECT_NEAR(mzv.length_s(), 0.75 * damped_period_s(45.0, 0.1), 1e-9);
}

double mean_s(const dynamics::ShaperPulses& pulses) {
  double mean_s = 0.0;
  for (const dynamics::Pulse& pulse : pulses) {
    mean_s += pulse.weight * pulse.time_s;
  }
  return mean_s;
}

// kin_shaper.c, shift_pulses: each axis by itself.
TEST(Shaping, KeepsBothAxesOfKlipperInStep) {
  gcode::Shaper shaper = shaper_of(55.2, 43.6);
  shaper.settings.type.y = "ei";
  const Shaping both = shaping(config_of(Firmware::klipper), shaper);
  EXPECT_NEAR(mean_s(both.x), 0.0, 1e-15);
  EXPECT_NEAR(mean_s(both.y), 0.0, 1e-15);
  EXPECT_DOUBLE_EQ(both.lead_s(), -std::min(both.x.front().time_s, both.y.front().time_s));
}

// Marlin, stepper.cpp; RepRapFirmware, AxisShaper.cpp.
TEST(Shaping, OfTheOthersBeginsWithThePlan) {
  for (const Firmware firmware : {Firmware::marlin, Firmware::rrf}) {
    const Shaping both = shaping(config_of(firmware), shaper_of(45.0, 30.0));
    EXPECT_EQ(both.x.front().time_s, 0.0);
    EXPECT_EQ(both.y.front().time_s, 0.0);
    EXPECT_EQ(both.lead_s(), 0.0);
    EXPECT_GT(mean_s(both.y), 1.4 * mean_s(both.x));
  }
}

TEST(Shaping, TakesTypeAndDampingOfTheFileBeforeThoseOfTheConfiguration) {
  gcode::Shaper shaper = kOn;
  shaper.settings.type.y = "ZV";
  shaper.settings.damping_ratio.y = 0.2;
  const Shaping both = shaping(config_of(Firmware::klipper), shaper);
  EXPECT_EQ(both.x.size(), 3U);
  ASSERT_EQ(both.y.size(), 2U);
  EXPECT_NEAR(both.y[1].time_s - both.y[0].time_s, 0.5 * damped_period_s(45.0, 0.2), 1e-12);
}

TEST(Shaping, OfKlipperHasTheParametersOfItsType) {
  gcode::Shaper shaper = kOn;
  shaper.settings.type.y = "MZV(n=5, t=1.1)";
  FirmwareConfig config = config_of(Firmware::klipper);
  config.shaper.type.x = "mzv(n=4,t=0.9)";
  const Shaping both = shaping(config, shaper);
  ASSERT_EQ(both.x.size(), 4U);
  ASSERT_EQ(both.y.size(), 5U);
  const double period_s = damped_period_s(45.0, 0.1);
  EXPECT_NEAR(both.x.back().time_s - both.x.front().time_s, 0.9 * period_s, 1e-12);
  EXPECT_NEAR(both.y.back().time_s - both.y.front().time_s, 1.1 * period_s, 1e-12);
}

TEST(Shaping, TakesTheFirmwaresDefaultForATypeThatItDoesNotKnow) {
  gcode::Shaper shaper = kOn;
  shaper.settings.type.x = "smooth_zv";
  EXPECT_EQ(shaping(config_of(Firmware::klipper), shaper).x.size(), 3U);
  EXPECT_EQ(shaping(config_of(Firmware::marlin), shaper).x.size(), 2U);
  EXPECT_EQ(shaping(config_of(Firmware::rrf), shaper).x.size(), 3U);
}

// Measured in a replay by Klipper's own host code, August 2026.
TEST(Switching, StopsKlipperForBothOfItsFilters) {
  const FirmwareConfig config = config_of(Firmware::klipper);
  EXPECT_NEAR(switching_s(config, {kOn}, {kOff}), 0.010528, 1e-6);
  EXPECT_NEAR(switching_s(config, {kOff}, {kOn}), 0.010528, 1e-6);
  EXPECT_NEAR(switching_s(config, {kOn}, {shaper_of(45.0, 0.0)}), 2 * 0.009528, 2e-6);
  EXPECT_DOUBLE_EQ(switching_s(config, {kOn}, {kOn}), 0.0);
  EXPECT_DOUBLE_EQ(switching_s(config, {kOff}, {kOff}), 0.0);
}

// The type and damping of a shaper that is off do not matter.
TEST(Switching, DoesNotStopWhereBothAreOff) {
  gcode::Shaper typed = kOff;
  typed.settings.type.x = "ei";
  typed.settings.kept_freq_hz = 40.0;
  for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
    EXPECT_DOUBLE_EQ(switching_s(config_of(firmware), {typed}, {kOff}), 0.0);
    EXPECT_DOUBLE_EQ(switching_s(config_of(firmware), {kOff}, {typed}), 0.0);
  }
}

gcode::PressureAdvance with(double advance_s, std::optional<double> smooth_s = {}) {
  return {advance_s, smooth_s};
}

TEST(Switching, WaitsForTheFilterOfPressureAdvanceToo) {
  FirmwareConfig config = config_of(Firmware::klipper);
  EXPECT_NEAR(switching_s(config, {kOn, with(0.05)}, {kOff, with(0.05)}), 0.040, 1e-12);
  config.pressure_advance_s = 0.03;
  EXPECT_NEAR(switching_s(config, {kOn}, {kOff}), 0.040, 1e-12);
  EXPECT_NEAR(switching_s(config, {kOn, with(0.0)}, {kOff, with(0.0)}), 0.010528, 1e-6)
      << "the file has switched it off";
  config.pressure_advance_smooth_s = 0.01;
  EXPECT_NEAR(switching_s(config, {kOn}, {kOff}), 0.009528 + 0.005, 1e-6);
}

TEST(Switching, StopsKlipperWherePressureAdvanceIsSwitchedOnOrOff) {
  const FirmwareConfig config = config_of(Firmware::klipper);
  EXPECT_NEAR(switching_s(config, {kOn, with(0.0)}, {kOn, with(0.05)}), 0.009528 + 0.020, 1e-6);
  EXPECT_NEAR(switching_s(config, {kOff, with(0.05)}, {kOff, with(0.0)}), 0.020 + 0.001, 1e-12);
  EXPECT_DOUBLE_EQ(switching_s(config, {kOn, with(0.03)}, {kOn, with(0.05)}), 0.0);
  EXPECT_NEAR(switching_s(config, {kOff, with(0.05)}, {kOff, with(0.05, 0.005)}), 0.020 + 0.0025,
              1e-12)
      << "another smooth time";
  EXPECT_DOUBLE_EQ(switching_s(config, {kOn, with(0.0)}, {kOn, with(0.0, 0.005)}), 0.0);
  EXPECT_DOUBLE_EQ(switching_s(config_of(Firmware::marlin), {kOn, with(0.0)}, {kOn, with(0.05)}),
                   0.0);
}

TEST(Switching, WaitsForTheDelayedPartOfTheMotionInMarlin) {
  const FirmwareConfig config = config_of(Firmware::marlin);
  EXPECT_NEAR(switching_s(config, {kOn}, {kOff}), 0.5 * damped_period_s(45.0, 0.15), 1e-12);
  EXPECT_DOUBLE_EQ(switching_s(config, {kOff}, {kOn}), 0.0);
}

TEST(Switching, EndsInRepRapFirmwaresGracePeriod) {
  const FirmwareConfig config = config_of(Firmware::rrf);
  EXPECT_NEAR(switching_s(config, {kOn}, {kOff}), damped_period_s(45.0, 0.1) + 0.010, 1e-12);
  EXPECT_NEAR(switching_s(config, {kOff}, {kOn}), 0.010, 1e-12);
}

}  // namespace
}  // namespace unflex::planner
