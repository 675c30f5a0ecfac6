#include "unflex/core/kinematics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

namespace unflex {
namespace {

TEST(MotorsOf, ACoreXyDoSumAndDifference) {
  const Motors motors(Kinematics::corexy, Firmware::klipper);
  EXPECT_TRUE(motors.shared_by_xy());
  EXPECT_DOUBLE_EQ(motors.of(0, 3.0, 4.0, 5.0), 7.0);
  EXPECT_DOUBLE_EQ(motors.of(1, 3.0, 4.0, 5.0), -1.0);
  EXPECT_DOUBLE_EQ(motors.of(2, 3.0, 4.0, 5.0), 5.0);
  EXPECT_DOUBLE_EQ(motors.largest_of_xy({3.0, -4.0}, 50.0), 7.0);
  EXPECT_DOUBLE_EQ(motors.uncertainty(1), 2.0);
  EXPECT_FALSE(motors.moves_xy(2));
}

TEST(MotorsOf, ACoreXzLiftThreeTimesAsFarOnRepRapFirmware) {
  const Motors klipper(Kinematics::corexz, Firmware::klipper);
  EXPECT_FALSE(klipper.shared_by_xy());
  EXPECT_DOUBLE_EQ(klipper.of(0, 3.0, 4.0, 5.0), 8.0);
  EXPECT_DOUBLE_EQ(klipper.of(2, 3.0, 4.0, 5.0), -2.0);
  EXPECT_DOUBLE_EQ(klipper.largest_of_xy({3.0, 4.0}, 5.0), 8.0);
  const Motors rrf(Kinematics::corexz, Firmware::rrf);
  EXPECT_DOUBLE_EQ(rrf.of(0, 3.0, 4.0, 5.0), 18.0);
  EXPECT_DOUBLE_EQ(rrf.of(2, 3.0, 4.0, 5.0), -12.0);
}

TEST(MotorsOf, AHybridShareOneMotor) {
  const Motors motors(Kinematics::hybrid_corexy, Firmware::klipper);
  EXPECT_TRUE(motors.shared_by_xy());
  EXPECT_DOUBLE_EQ(motors.of(0, 3.0, 4.0, 5.0), -1.0);
  EXPECT_DOUBLE_EQ(motors.of(1, 3.0, 4.0, 5.0), 4.0);
}

TEST(MotorsOf, AnyMachineTellWhereItIs) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> place(-300.0, 300.0);
  for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
    for (const Kinematics kinematics : all_kinematics()) {
      const Motors motors(kinematics, firmware);
      for (int i = 0; i < 20; ++i) {
        const std::array<double, 3> at = {place(random), place(random), place(random)};
        std::array<double, 3> q{};
        for (std::size_t motor = 0; motor < q.size(); ++motor) {
          q[motor] = motors.of(motor, at[0], at[1], at[2]);
        }
        const std::array<double, 3> back = motors.axes(q);
        for (std::size_t axis = 0; axis < at.size(); ++axis) {
          EXPECT_NEAR(back[axis], at[axis], 1e-12) << to_string(kinematics);
        }
      }
    }
  }
}

}  // namespace
}  // namespace unflex
