#include "unflex/kinematics/delta.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "checks.hpp"

namespace unflex::kinematics {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

Delta example() {
  return delta_on_circle(125.0, 250.0, {210.0 * kDegree, 330.0 * kDegree, 90.0 * kDegree});
}

const Box kBox{{{{-56, 56}, {-56, 56}, {0, 200}}}};

// How far the tool is from where it would be on its line, from middle − s u / 2 to middle + s u /
// 2, while a motion that is straight in the joints takes it from end to end.
double line_error_mm(const Delta& machine, const Point& middle, const Point& u, double s) {
  const Joints first = *to_joints(machine, moved(middle, u, -0.5 * s));
  const Joints last = *to_joints(machine, moved(middle, u, 0.5 * s));
  double largest = 0.0;
  for (int k = 1; k < 8; ++k) {
    const double share = k / 8.0;
    Joints q{};
    for (std::size_t i = 0; i < q.size(); ++i) {
      q[i] = (1.0 - share) * first[i] + share * last[i];
    }
    const Point off = moved(*to_point(machine, q), moved(middle, u, (share - 0.5) * s), -1.0);
    largest = std::max(largest, std::hypot(off[0], off[1], off[2]));
  }
  return largest;
}

TEST(ADelta, HasItsCarriagesWhereTheToolNeedsThem) {
  const Delta machine = example();
  expect_near(*to_joints(machine, {0, 0, 0}), {216.506351, 216.506351, 216.506351}, 5e-7);
  expect_near(*to_joints(machine, {50, 0, 0}), {183.165724, 234.947478, 210.653744}, 5e-7);
  expect_near(*to_joints(machine, {-60, -60, 100}), {345.286325, 284.890830, 257.082781}, 5e-7);
}

TEST(ADelta, TellsSpeedAndAccelerationOfItsCarriages) {
  const Machine machine{example(), {}};
  const Point p = {10, -20, 30};
  const Point v = {100, 50, 10};
  expect_near(joint_velocity(machine, p, v), {-54.547504, 44.084194, 40.726353}, 5e-7);
  expect_near(joint_acceleration(machine, p, v, {2000, -1000, 300}),
              {-674.7734, 1297.4510, -577.2699}, 5e-5);
  EXPECT_FALSE(is_uniform(machine));
}

TEST(ADelta, GoesBackAndForth) {
  const Machine machine{example(), {}};
  expect_round_trips(machine, kBox);
  expect_derivatives(machine, kBox);
}

TEST(ADelta, MayHaveRodsAndTowersOfTheirOwn) {
  Delta machine = example();
  machine.towers[0].rod_mm = 251.3;
  machine.towers[1].x_mm += 1.7;
  machine.towers[2].rod_mm = 248.6;
  const Machine crooked{machine, {}};
  expect_round_trips(crooked, kBox);
  expect_derivatives(crooked, kBox);
}

// Klipper turns the towers' order around where a printer has it so.
TEST(ADelta, TakesTheLowerPlaceForAnyOrderOfTowers) {
  Delta machine = example();
  std::swap(machine.towers[0], machine.towers[1]);
  expect_round_trips({machine, {}}, kBox);
}

TEST(ADelta, RefusesFlatRods) {
  const Delta machine = example();
  const Point away = {machine.towers[2].x_mm, machine.towers[2].y_mm - 249.0, 0};
  ASSERT_TRUE(to_joints(machine, away));
  EXPECT_EQ(fault(machine, {0, 0, 0}), std::nullopt);
  // w = √(250² − 249.7²) = 12.24 < 12.5
  const Point flat = {0, 125.0 - 249.7, 0};
  EXPECT_TRUE(to_joints(machine, flat));
  EXPECT_EQ(
      *fault(machine, flat),
      "the rod of tower C would have to reach 249.7 mm sideways, and its 250 mm are safe up to "
      "249.687 mm");
  EXPECT_FALSE(fault(machine, {0, 125.0 - 249.68, 0}));
  const Result<Joints> beyond = to_joints(machine, {0, -130, 0});
  ASSERT_FALSE(beyond);
  EXPECT_EQ(beyond.error().kind, ErrorKind::input);
  EXPECT_EQ(longest_line_mm(machine, {0, -130, 0}, {1, 0, 0}, 1e-3), 0.0);
}

TEST(ADelta, HasNoPlaceForCarriagesFarFromEachOther) {
  EXPECT_TRUE(to_point(example(), {200, 200, 200}));
  const Result<Point> none = to_point(example(), {0, 600, 0});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().message,
            "no place is a rod away from the carriages at 0, 600 and 0 mm; they are too far from "
            "each other");
}

// A line of length s is bent by s² of what a line of 1 mm is. The worst is at the edge.
TEST(ADelta, BendsLines) {
  const Delta machine = example();
  struct Case {
    double length_mm;
    double worst_um;
    double bound_um;
    double digits_um;
  };
  for (const Case& of : {Case{0.5, 0.404, 0.978, 0.0006}, Case{1.0, 1.616, 3.913, 0.0006},
                         Case{2.0, 6.464, 15.653, 0.0006}, Case{5.0, 40.43, 97.83, 0.006}}) {
    double worst_mm = 0.0;
    double bound_mm = 0.0;
    for (const double radius : {20.0, 50.0, 80.0}) {
      for (int place = 0; place < 120; ++place) {
        for (int way = 0; way < 36; ++way) {
          const Point middle = {radius * std::cos(3.0 * place * kDegree),
                                radius * std::sin(3.0 * place * kDegree), 50.0};
          const Point u = {std::cos(5.0 * way * kDegree), std::sin(5.0 * way * kDegree), 0.0};
          const double error_mm = line_error_mm(machine, middle, u, of.length_mm);
          const double of_this_mm =
              of.length_mm * of.length_mm / 8.0 * bend_of_line(machine, middle, u);
          EXPECT_LE(error_mm, of_this_mm);
          worst_mm = std::max(worst_mm, error_mm);
          bound_mm = std::max(bound_mm, of_this_mm);
        }
      }
    }
    EXPECT_NEAR(1e3 * worst_mm, of.worst_um, of.digits_um) << of.length_mm;
    EXPECT_NEAR(1e3 * bound_mm, of.bound_um, of.digits_um) << of.length_mm;
  }
}

TEST(ADelta, KeepsTheToleranceOfItsLongestLine) {
  const Delta machine = example();
  const Box directions{{{{-1, 1}, {-1, 1}, {-1, 1}}}};
  std::mt19937_64 random(23);
  for (const double tolerance_mm : {1e-4, 1e-3, 0.02}) {
    for (int k = 0; k < 300; ++k) {
      const Point p = kBox.place(random);
      Point u = directions.place(random);
      const double norm = std::hypot(u[0], u[1], u[2]);
      u = {u[0] / norm, u[1] / norm, u[2] / norm};
      const double s = longest_line_mm(machine, p, u, tolerance_mm);
      ASSERT_GT(s, 0.3 * std::sqrt(tolerance_mm / 1e-3));
      const double error = line_error_mm(machine, moved(p, u, 0.5 * s), u, s);
      EXPECT_LE(error, tolerance_mm);
    }
  }
  EXPECT_TRUE(std::isinf(longest_line_mm(machine, {0, 0, 0}, {0, 0, 1}, 1e-3)));
}

}  // namespace
}  // namespace unflex::kinematics
