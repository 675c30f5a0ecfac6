#include "unflex/core/kinematics.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
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

void expect_row(const Motors::Row& row, const Motors::Row& expected) {
  for (std::size_t axis = 0; axis < row.size(); ++axis) {
    EXPECT_NEAR(row[axis], expected[axis], 1e-6) << "axis " << axis;
  }
}

TEST(ATripteron, HasItsSlidersWhereTheToolNeedsThem) {
  const Motors motors(Kinematics::tripteron, Firmware::klipper);
  struct Case {
    std::array<double, 3> tool;
    std::array<double, 3> sliders;
  };
  for (const Case& at : {Case{{250, 0, 100}, {150, 150, 350}}, Case{{250, 75, 100}, {225, 75, 350}},
                         Case{{350, 0, 250}, {100, 100, 600}}, Case{{300, 0, 100}, {200, 200, 400}},
                         Case{{10, 20, 30}, {0, -40, 40}}}) {
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_DOUBLE_EQ(motors.of(i, at.tool), at.sliders[i]);
    }
  }
  EXPECT_TRUE(motors.shared_by_xy());
  EXPECT_EQ(motors.names()[2], "C");
  const Motors::Rows inverse = motors.inverse();
  expect_row(inverse[0], {0.25, 0.25, 0.5});
  expect_row(inverse[1], {0.5, -0.5, 0.0});
  expect_row(inverse[2], {-0.25, -0.25, 0.5});
}

// Speeds of the sliders per unit of the tool's speed along u.
TEST(ATripteron, MovesItsSlidersByTheDirection) {
  const Motors motors(Kinematics::tripteron, Firmware::klipper);
  const double half = std::sqrt(0.5);
  const double third = 1.0 / std::sqrt(3.0);
  const auto speeds = [&](double x, double y, double z) {
    return Motors::Row{motors.of(0, x, y, z), motors.of(1, x, y, z), motors.of(2, x, y, z)};
  };
  expect_row(speeds(1, 0, 0), {1, 1, 1});
  expect_row(speeds(0, 1, 0), {1, -1, 0});
  expect_row(speeds(0, 0, 1), {-1, -1, 1});
  expect_row(speeds(half, half, 0), {1.41421356, 0, 0.70710678});
  expect_row(speeds(third, third, third), {0.57735027, -0.57735027, 1.15470054});
  EXPECT_NEAR(300.0 / motors.largest_of_xy({half, half}), 212.132, 1e-3);
}

TEST(AMatrix, MustMoveAllAxesIndependently) {
  const auto rows_of = [](Kinematics kinematics) {
    return Motors(kinematics, Firmware::klipper).rows();
  };
  for (const Kinematics kinematics : all_kinematics()) {
    EXPECT_FALSE(Motors::fault(rows_of(kinematics))) << to_string(kinematics);
  }
  EXPECT_TRUE(Motors::fault({{{1, 1, 0}, {2, 2, 0}, {0, 0, 1}}}));
  EXPECT_TRUE(Motors::fault({{{1, 0, 0}, {0, 1, 0}, {0, 0, 0}}}));
  EXPECT_TRUE(Motors::fault({{{0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.09}}})) << "determinant 9e-4";
  EXPECT_FALSE(Motors::fault({{{0.1, 0, 0}, {0, 0.1, 0}, {0, 0, 0.11}}}));
}

// Turning the axes changes neither singular value.
TEST(AMatrix, MayTakeTwentyTimesTheTravelOneWay) {
  const double c = std::cos(0.3);
  const double s = std::sin(0.3);
  EXPECT_FALSE(Motors::fault({{{c, s, 0}, {-s, c, 0}, {0, 0, 19.9}}}));
  EXPECT_TRUE(Motors::fault({{{c, s, 0}, {-s, c, 0}, {0, 0, 20.1}}}));
  EXPECT_FALSE(Motors::fault({{{19.9 * c, 19.9 * s, 0}, {-s, c, 0}, {0, 0, 5}}}));
  EXPECT_TRUE(Motors::fault({{{20.1 * c, 20.1 * s, 0}, {-s, c, 0}, {0, 0, 5}}}));
}

TEST(AMatrix, TellsHowFarMotorsGo) {
  const Motors motors(Motors::Rows{{{2, 0, 0}, {0.5, -1, 0}, {0, 0, 1}}});
  EXPECT_DOUBLE_EQ(motors.gain_of_xy(), 2.0);
  EXPECT_DOUBLE_EQ(motors.gain_of_both(), 2.0);
  const Motors core(Kinematics::corexy, Firmware::rrf);
  EXPECT_DOUBLE_EQ(core.gain_of_xy(), 1.0);
  EXPECT_DOUBLE_EQ(core.gain_of_both(), 2.0);
}

}  // namespace
}  // namespace unflex
