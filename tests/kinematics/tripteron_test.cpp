#include "unflex/kinematics/tripteron.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "checks.hpp"

namespace unflex::kinematics {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Motors default_motors() { return {Kinematics::tripteron, Firmware::klipper}; }

// A machine whose bars of 150 mm are assumed.
Tripteron example() {
  Tripteron machine;
  machine.linear.motors = default_motors();
  machine.legs = {Leg{80, 0, {-20, 25, 10}}, Leg{-80, 0, {-20, -25, 10}}, Leg{0, 0, {20, 0, 10}}};
  machine.bars = {.upper_mm = 150, .lower_mm = 150};
  machine.linear.offset_mm = offset_of_legs(machine.linear.motors.rows(), machine.legs);
  return machine;
}

const Box kBox{{{{-200, 200}, {-40, 40}, {0, 150}}}};

// A leg's plane is n·(T − S) = 0, so a tool at T needs its slider where the plane meets the rail.
TEST(ARail, GivesTheRowOfItsPlane) {
  expect_near(row_of_rail(45.0 * kDegree, 0.0, true), {1.0, 0.0, -1.0}, 1e-6);
  expect_near(row_of_rail(45.0 * kDegree, 45.0 * kDegree, true), {1.0, 1.0, -1.41421356}, 1e-6);
  expect_near(row_of_rail(45.0 * kDegree, 30.0 * kDegree, true), {1.0, 0.57735027, -1.15470054},
              1e-6);
  const double diagonal = 54.735610317245346 * kDegree;
  expect_near(row_of_rail(diagonal, 45.0 * kDegree, true), {1.0, 1.0, -1.0}, 1e-6);
  expect_near(row_of_rail(45.0 * kDegree, 0.0, false), {1.0, 0.0, 1.0}, 1e-6);
}

TEST(ARail, HasItsSliderInThePlaneOfTheLeg) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> place(-100.0, 100.0);
  std::uniform_real_distribution<double> unit(0.05, 0.95);
  for (int i = 0; i < 200; ++i) {
    const double tilt = unit(random) * std::numbers::pi / 2.0;
    const double azimuth = (2.0 * unit(random) - 1.0) * 0.45 * std::numbers::pi;
    const Motors::Row row = row_of_rail(tilt, azimuth, true);
    const double n[3] = {std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth),
                         -std::cos(tilt)};
    const double tool[3] = {place(random), place(random), place(random)};
    // The rail passes through the origin.
    const double slider = row[0] * tool[0] + row[1] * tool[1] + row[2] * tool[2];
    EXPECT_NEAR(n[0] * (tool[0] - slider) + n[1] * tool[1] + n[2] * tool[2], 0.0, 1e-10);
  }
}

TEST(ATripteron, HasItsSlidersWhereTheToolNeedsThem) {
  const Machine machine{Linear{default_motors(), {}}, {}};
  struct Case {
    Point tool;
    Joints sliders;
    Point direction;
    Joints speeds;
    double fastest_mm_s;  // of the tool, at 300 mm/s per joint
  };
  const double half = std::sqrt(0.5);
  const double third = 1.0 / std::sqrt(3.0);
  for (const Case& at :
       {Case{{250, 0, 100}, {150, 150, 350}, {1, 0, 0}, {1, 1, 1}, 300},
        Case{{250, 75, 100}, {225, 75, 350}, {0, 1, 0}, {1, -1, 0}, 300},
        Case{{350, 0, 250}, {100, 100, 600}, {0, 0, 1}, {-1, -1, 1}, 300},
        Case{{300, 0, 100}, {200, 200, 400}, {half, half, 0}, {1.414214, 0, 0.707107}, 212.132},
        Case{{10, 20, 30},
             {0, -40, 40},
             {third, third, third},
             {0.57735, -0.57735, 1.154701},
             259.808}}) {
    expect_near(*to_joints(machine, at.tool), at.sliders, 1e-12);
    const Joints speeds = joint_velocity(machine, at.tool, at.direction);
    expect_near(speeds, at.speeds, 1e-6);
    const double largest =
        std::max({std::abs(speeds[0]), std::abs(speeds[1]), std::abs(speeds[2])});
    EXPECT_NEAR(300.0 / largest, at.fastest_mm_s, 1e-3);
  }
}

TEST(ATripteron, HasTheDefaultsInverse) {
  const Matrix back = inverse(default_motors().rows());
  expect_near(back[0], {0.25, 0.25, 0.5}, 1e-14);
  expect_near(back[1], {0.5, -0.5, 0.0}, 1e-14);
  expect_near(back[2], {-0.25, -0.25, 0.5}, 1e-14);
  EXPECT_NEAR(condition(default_motors().rows()), std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(norm_of_inverse(default_motors().rows()), std::sqrt(0.5), 1e-12);
}

TEST(ATripteron, GoesBackAndForth) {
  const Machine machine{example(), {}};
  expect_round_trips(machine, kBox);
  expect_derivatives(machine, kBox);
}

// The lateral, the vertical and the longitudinal experiment, in which A and B do the same but for
// the lateral one.
TEST(ATripteron, DoesTheThreeExperiments) {
  const Machine machine{Linear{default_motors(), {}}, {}};
  for (int k = 0; k <= 100; ++k) {
    const double t = 2.0 * std::numbers::pi * k / 100.0;
    const double lateral = 75.0 * std::sin(t);
    expect_near(*to_joints(machine, {250, lateral, 100}), {150 + lateral, 150 - lateral, 350},
                1e-9);
    const double up = 50.0 * std::sin(2.0 * t);
    expect_near(*to_joints(machine, {350, 0, 200 + up}), {150 - up, 150 - up, 550 + up}, 1e-9);
    const double along = 50.0 * std::sin(4.0 * t);
    expect_near(*to_joints(machine, {250 + along, 0, 100}), {150 + along, 150 + along, 350 + along},
                1e-9);
    expect_near(joint_velocity(machine, {250, lateral, 100}, {0, 75 * std::cos(t), 0}),
                {75 * std::cos(t), -75 * std::cos(t), 0}, 1e-9);
    expect_near(joint_acceleration(machine, {250, lateral, 100}, {0, 75 * std::cos(t), 0},
                                   {0, -75 * std::sin(t), 0}),
                {-75 * std::sin(t), 75 * std::sin(t), 0}, 1e-9);
  }
}

TEST(TheLegsOfATripteron, AreAsLongAsTheirToolNeeds) {
  const Tripteron machine = example();
  struct Case {
    Point tool;
    Joints sliders;
    std::array<double, 3> lengths;
  };
  for (const Case& at : {Case{{100, 0, 100}, {-85, -85, 230}, {205.7912, 205.7912, 155.5635}},
                         Case{{100, 40, 100}, {-45, -125, 230}, {167.1825, 251.2966, 160.6238}},
                         Case{{100, 0, 180}, {-165, -165, 310}, {314.8809, 314.8809, 268.7006}}}) {
    expect_near(*to_joints(machine, at.tool), at.sliders, 1e-12);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(length_of_leg_mm(machine, i, at.tool), at.lengths[i], 5e-5);
      // The joints of slider and tool themselves.
      const Leg& leg = machine.legs[i];
      const double dx = at.tool[0] + leg.tool_joint_mm[0] - at.sliders[i];
      const double dy = at.tool[1] + leg.tool_joint_mm[1] - leg.rail_y_mm;
      const double dz = at.tool[2] + leg.tool_joint_mm[2] - leg.rail_z_mm;
      EXPECT_NEAR(std::sqrt(dx * dx + dy * dy + dz * dz), at.lengths[i], 5e-5);
    }
  }
}

TEST(TheLegsOfATripteron, EndItsReach) {
  const Machine machine{example(), {}};
  EXPECT_FALSE(fault(machine, {100, 0, 100}));
  EXPECT_FALSE(fault(machine, {100, 40, 100}));
  EXPECT_FALSE(fault(machine, {100, 0, 169.2153}));
  EXPECT_TRUE(fault(machine, {100, 0, 169.2155}));
  EXPECT_FALSE(fault(machine, {-5000, 0, 169.2153})) << "the workspace is a prism along X";
  EXPECT_EQ(*fault(machine, {100, 0, 180}),
            "leg A would have to be 314.881 mm long, and it is straight at 300 mm");
}

TEST(TheLegsOfATripteron, MayNotFoldBeyondTheirElbow) {
  Tripteron machine = example();
  machine.bars.lower_mm = 100.0;
  // Leg C is 2 Δz² + Δy² long, squared.
  const auto at_length = [](double length) { return Point{0, 0, length / std::sqrt(2.0) - 10.0}; };
  machine.legs[0] = machine.legs[1] = machine.legs[2];
  machine.linear.motors = Motors(Motors::Rows{{{1, 0, -1}, {1, 0.01, -1}, {1, 0, 1}}});
  EXPECT_FALSE(fault(machine, at_length(50.001)));
  EXPECT_TRUE(fault(machine, at_length(49.999)));
  EXPECT_TRUE(fault(machine, at_length(250.001)));
  machine.bars.least_elbow_rad = 60.0 * kDegree;
  machine.bars.most_elbow_rad = 90.0 * kDegree;
  const double shortest = std::sqrt(150.0 * 150.0 + 100.0 * 100.0);
  const double longest = std::sqrt(150.0 * 150.0 + 100.0 * 100.0 + 150.0 * 100.0);
  EXPECT_FALSE(fault(machine, at_length(shortest + 1e-3)));
  EXPECT_FALSE(fault(machine, at_length(longest - 1e-3)));
  EXPECT_EQ(*fault(machine, at_length(shortest - 1.0)),
            "leg A would have to be 179.278 mm long, and its elbow is at 90° at 180.278 mm");
  EXPECT_TRUE(fault(machine, at_length(longest + 1e-3)));
}

}  // namespace
}  // namespace unflex::kinematics
