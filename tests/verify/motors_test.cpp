// The base's limits apply to its motors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "unflex/verify/verify.hpp"

namespace unflex::verify {
namespace {

using ::testing::HasSubstr;

// 20 ms at an even speed, from rest to rest.
planner::PlannedMove even_move(double x_mm_s, double y_mm_s, double z_mm_s) {
  constexpr double kDuration_s = 0.02;
  planner::PlannedMove move;
  move.segment.line = 7;
  move.segment.start_mm = {50.0, 50.0, 1.0, 0.0};
  move.segment.end_mm = {50.0 + kDuration_s * x_mm_s, 50.0 + kDuration_s * y_mm_s,
                         1.0 + kDuration_s * z_mm_s, 0.0};
  const double v = std::hypot(x_mm_s, y_mm_s, z_mm_s);
  move.direction = {x_mm_s / v, y_mm_s / v, z_mm_s / v, 0.0};
  move.length_mm = v * kDuration_s;
  move.cruise_v_mm_s = v;
  move.cruise_s = kDuration_s;
  return move;
}

std::string broken(Kinematics kinematics, const planner::PlannedMove& move, double max_velocity,
                   double max_accel) {
  Rules rules;
  rules.fixed.motors = Motors(kinematics, rules.fixed.firmware);
  rules.base_max_velocity_mm_s = max_velocity;
  rules.base_max_accel_mm_s2 = max_accel;
  return broken_rule({move}, {move}, rules).value_or("");
}

TEST(BaseLimits, AreThoseOfMotors) {
  const auto move = even_move(100.0, 80.0, 0.0);
  // The move's speed is reached from rest in half of the move's time.
  EXPECT_EQ(broken(Kinematics::cartesian, move, 101.0, 10100.0), "");
  EXPECT_THAT(broken(Kinematics::corexy, move, 101.0, 1e6), HasSubstr("base velocity 180 mm/s"));
  EXPECT_THAT(broken(Kinematics::corexy, move, 181.0, 17000.0),
              HasSubstr("base acceleration 1.8e+04 mm/s²"));
  EXPECT_EQ(broken(Kinematics::corexy, move, 181.0, 18100.0), "");
  EXPECT_EQ(broken(Kinematics::hybrid_corexy, move, 81.0, 8100.0), "");
  const auto across = even_move(100.0, -80.0, 0.0);
  EXPECT_THAT(broken(Kinematics::corexy, across, 179.0, 1e6), HasSubstr("base velocity 180"));
  EXPECT_THAT(broken(Kinematics::hybrid_corexy, across, 179.0, 1e6), HasSubstr("base velocity"));
}

TEST(BaseLimits, CountZWhereItsMotorsMoveX) {
  const auto move = even_move(100.0, 0.0, 20.0);
  EXPECT_EQ(broken(Kinematics::cartesian, move, 101.0, 10100.0), "");
  EXPECT_EQ(broken(Kinematics::corexy, move, 101.0, 10100.0), "");
  EXPECT_THAT(broken(Kinematics::corexz, move, 119.0, 1e6), HasSubstr("base velocity 120"));
}

}  // namespace
}  // namespace unflex::verify
