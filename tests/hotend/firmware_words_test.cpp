#include "unflex/hotend/firmware_words.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hotend/reference.hpp"

namespace unflex::hotend {
namespace {

TEST(FirmwareWords, AreThoseOfKlipperAndMarlin) {
  const Gains found = *gains(Rule::simc_pid, kReference);
  EXPECT_EQ(klipper_words(found), "pid_kp = 15.938\npid_ki = 0.375\npid_kd = 37.500\n");
  EXPECT_EQ(marlin_words(found), "M301 P15.938 I0.3750 D37.500");
}

TEST(FirmwareWords, CountTo255WhateverThePlantDoes) {
  Plant plant = kReference;
  plant.gain_c *= 255.0;
  plant.full_power = 1.0;
  const Gains found = *gains(Rule::simc_pid, plant);
  EXPECT_EQ(marlin_words(found, plant.full_power), "M301 P15.938 I0.3750 D37.500");
  EXPECT_EQ(klipper_words(found, plant.full_power),
            "pid_kp = 15.938\npid_ki = 0.375\npid_kd = 37.500\n");
}

TEST(FirmwareWords, GiveRepRapFirmwareItsModel) {
  // At 100 °C above the room the exponent does not matter.
  EXPECT_EQ(rrf_words(rrf_model(kReference, 125.0)), "M307 H1 R1.693 K0.332 D6.25 E1.35 S1.00");
  const RrfModel model = rrf_model(kReference, 220.0);
  EXPECT_DOUBLE_EQ(model.heating_rate_c_s, 2.0 * 255.0 / 301.25);
  // The power that holds 220 °C is the same in both.
  EXPECT_NEAR(model.cooling_rate_c_s * std::pow(1.95, 1.35) / model.heating_rate_c_s,
              kReference.holding_power(220.0) / 255.0, 1e-12);
}

}  // namespace
}  // namespace unflex::hotend
