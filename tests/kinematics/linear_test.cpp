#include "unflex/kinematics/linear.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "checks.hpp"

namespace unflex::kinematics {
namespace {

const Box kBox{{{{-200, 200}, {-200, 200}, {0, 300}}}};

Machine machine_of(Kinematics kinematics, const Joints& offset_mm = {}) {
  return {Linear{Motors(kinematics, Firmware::klipper), offset_mm}, {}};
}

TEST(ALinearMachine, GoesBackAndForth) {
  for (const Kinematics kinematics : all_kinematics()) {
    const Machine machine = machine_of(kinematics, {10.0, -20.0, 300.0});
    expect_round_trips(machine, kBox);
    expect_derivatives(machine, kBox);
    EXPECT_TRUE(is_uniform(machine));
  }
}

TEST(ALinearMachine, MayBeAnyInverseOfItsRows) {
  const Matrix skewed = {{{1, 0.2, -0.7}, {0.4, -1.1, 0}, {0.1, 0.3, 1.3}}};
  expect_round_trips({Linear{Motors(skewed), {}}, {}}, kBox);
  const Matrix back = inverse(skewed);
  for (std::size_t i = 0; i < 3; ++i) {
    Point unit{};
    unit[i] = 1.0;
    expect_near(product(skewed, product(back, unit)), unit, 1e-14);
  }
}

TEST(ALinearMachine, MovesByItsRowsAlone) {
  const Machine machine = machine_of(Kinematics::corexy, {100.0, 0.0, 0.0});
  expect_near(*to_joints(machine, {10, 20, 0.2}), {130, -10, 0.2}, 1e-12);
  expect_near(joint_velocity(machine, {0, 0, 0}, {30, 40, 5}), {70, -10, 5}, 1e-12);
  expect_near(joint_acceleration(machine, {0, 0, 0}, {30, 40, 5}, {3000, -4000, 0}),
              {-1000, 7000, 0}, 1e-12);
}

TEST(ALinearMachine, TakesLinesOfAnyLength) {
  EXPECT_TRUE(
      std::isinf(longest_line_mm(machine_of(Kinematics::corexz), {1, 2, 3}, {0, 1, 0}, 1e-3)));
}

TEST(ARange, MakesAPlaceOutOfReach) {
  Machine machine = machine_of(Kinematics::corexy);
  EXPECT_FALSE(fault(machine, {150, 80, 0}));
  machine.ranges_mm[1] = JointRange{-50.0, 50.0};
  EXPECT_FALSE(fault(machine, {150, 100, 0})) << "on the edge";
  EXPECT_EQ(*fault(machine, {150, 80, 0}),
            "joint B would have to be at 70 mm, and its range is -50 to 50");
  EXPECT_TRUE(fault(machine, {0, 50.1, 0}));
}

TEST(ACondition, IsTheRatioOfSingularValues) {
  EXPECT_DOUBLE_EQ(condition(Motors().rows()), 1.0);
  EXPECT_NEAR(condition(Motors(Kinematics::corexy, Firmware::klipper).rows()), std::sqrt(2.0),
              1e-12);
  EXPECT_NEAR(norm_of_inverse({{{2, 0, 0}, {0, 4, 0}, {0, 0, 8}}}), 0.5, 1e-12);
  EXPECT_GT(condition({{{1, 1, 0}, {2, 2, 0}, {0, 0, 1}}}), 1e12);
}

}  // namespace
}  // namespace unflex::kinematics
