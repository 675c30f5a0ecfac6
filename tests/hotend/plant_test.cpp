#include "unflex/hotend/plant.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "hotend/reference.hpp"

namespace unflex::hotend {
namespace {

TEST(Plant, HasTheUltimateCycleOfItsPhaseEquation) {
  // By a controller that samples every 0.5 s.
  const Result<Ultimate> found = ultimate(kReference);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->gain, 35.602, 5e-4);
  EXPECT_NEAR(found->period_s, 29.906, 5e-4);
}

// One lag cannot have a period above 4θ, the reference has.
TEST(Plant, OscillatesSlowerThanOneLagCould) {
  Plant plant = kReference;
  plant.sensor_lag_s = 0.0;
  EXPECT_LT(ultimate(plant, 0.0)->period_s, 4.0 * plant.dead_time_s);
  EXPECT_GT(ultimate(kReference, 0.0)->period_s, 4.0 * plant.dead_time_s);
}

TEST(Plant, BecomesOneLagByTheHalfRule) {
  EXPECT_DOUBLE_EQ(kReference.one_lag().time_constant_s, 301.25);
  EXPECT_DOUBLE_EQ(kReference.one_lag().dead_time_s, 6.25);
  EXPECT_NEAR(kReference.heating_rate_c_s(), 1.69, 5e-3);
}

TEST(Plant, IsRefusedWithValuesThatAreNone) {
  Plant plant = kReference;
  plant.dead_time_s = 0.0;
  EXPECT_TRUE(check(plant));
  EXPECT_FALSE(ultimate(plant, 0.0));
  plant.gain_c = 0.0;
  EXPECT_EQ(check(plant).error().message, "the hotend's gain_c is 0; give a number above 0");
  plant = kReference;
  plant.sensor_lag_s = -1.0;
  EXPECT_EQ(check(plant).error().message,
            "the hotend's sensor_lag_s is -1; give a number of at least 0");
  plant = kReference;
  plant.ambient_c = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(check(plant));
  EXPECT_FALSE(ultimate(plant));
}

double after(const Plant& plant, double power, double time_s) {
  const double tau1 = plant.time_constant_s;
  const double tau2 = plant.sensor_lag_s;
  const double t = std::max(0.0, time_s - plant.dead_time_s);
  return plant.ambient_c +
         plant.gain_c * power *
             (1.0 - (tau1 * std::exp(-t / tau1) - tau2 * std::exp(-t / tau2)) / (tau1 - tau2));
}

TEST(Simulation, IsExactForAnySteps) {
  for (const double step_s : {0.05, 0.3, 0.7, 4.0, 13.0}) {
    Simulation simulation(kReference, 25.0);
    for (int k = 1; k <= 40; ++k) {
      simulation.advance(100.0, step_s);
      EXPECT_NEAR(simulation.temperature_c(), after(kReference, 100.0, k * step_s), 1e-9);
    }
  }
}

TEST(Simulation, FollowsEachChangeAfterTheDeadTime) {
  Simulation simulation(kReference, 25.0);
  simulation.advance(100.0, 3.3);
  simulation.advance(0.0, 60.0);
  EXPECT_NEAR(simulation.temperature_c(),
              after(kReference, 100.0, 63.3) - after(kReference, 100.0, 60.0) + 25.0, 1e-9);
}

TEST(Simulation, RestsWhereItIsHeld) {
  Simulation simulation(kReference, 200.0);
  simulation.advance(kReference.holding_power(200.0), 1000.0);
  EXPECT_NEAR(simulation.temperature_c(), 200.0, 1e-9);
}

// Steps in which both lags are the same, or nearly so, or the second is none.
TEST(Simulation, HasNoGapWhereLagsMeet) {
  const auto rise = [](double sensor_lag_s) {
    Plant plant{.gain_c = 1.0, .time_constant_s = 10.0, .sensor_lag_s = sensor_lag_s};
    Simulation simulation(plant, 25.0);
    simulation.advance(100.0, 7.0);
    return simulation.temperature_c();
  };
  EXPECT_NEAR(rise(10.0), rise(10.0 + 1e-9), 1e-7);
  EXPECT_NEAR(rise(10.0), rise(10.0 + 1e-2), 0.05);
  EXPECT_NEAR(rise(0.0), rise(1e-9), 1e-7);
}

TEST(Melting, TakesSomeWatts) {
  EXPECT_NEAR(melting_power_w(15.0, 195.0), 6.5, 0.05);
  // 6.5 W of a heater of 40 W are 41 of 255 counts, and cool the block by 83 °C in the end.
  const double load = load_in_counts(kReference, 6.5, 40.0);
  EXPECT_NEAR(load, 41.4, 0.1);
  Simulation simulation(kReference, 220.0);
  simulation.advance(kReference.holding_power(220.0), 5000.0, load);
  EXPECT_NEAR(simulation.temperature_c(), 220.0 - 2.0 * load, 1e-4);
}

}  // namespace
}  // namespace unflex::hotend
