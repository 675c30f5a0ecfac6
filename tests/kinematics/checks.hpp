// Checks that every kind of machine has to pass.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <utility>

#include "unflex/kinematics/machine.hpp"

namespace unflex::kinematics {

inline void expect_near(const std::array<double, 3>& found, const std::array<double, 3>& expected,
                        double tolerance) {
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_NEAR(found[i], expected[i], tolerance) << "component " << i;
  }
}

// p + s v
inline Point moved(Point p, const Point& v, double s) {
  for (std::size_t i = 0; i < p.size(); ++i) {
    p[i] += s * v[i];
  }
  return p;
}

// A box of places, mm, in which the machine has joints.
struct Box {
  std::array<std::pair<double, double>, 3> sides_mm;

  Point place(std::mt19937_64& random) const {
    Point p{};
    for (std::size_t i = 0; i < p.size(); ++i) {
      p[i] = std::uniform_real_distribution<double>(sides_mm[i].first, sides_mm[i].second)(random);
    }
    return p;
  }
};

inline void expect_round_trips(const Machine& machine, const Box& box) {
  std::mt19937_64 random(17);
  for (int k = 0; k < 1000; ++k) {
    const Point p = box.place(random);
    const Result<Joints> q = to_joints(machine, p);
    ASSERT_TRUE(q);
    const Result<Point> back = to_point(machine, *q);
    ASSERT_TRUE(back);
    expect_near(*back, p, 1e-9);
  }
}

inline void expect_derivatives(const Machine& machine, const Box& box) {
  constexpr double kStep_mm = 1e-3;
  constexpr double kStep_s = 1e-4;
  const Box speeds{{{{-200, 200}, {-200, 200}, {-20, 20}}}};
  const Box accels{{{{-5000, 5000}, {-5000, 5000}, {-500, 500}}}};
  std::mt19937_64 random(19);
  for (int k = 0; k < 200; ++k) {
    const Point p = box.place(random);
    const Matrix J = jacobian(machine, p);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Point u{};
      u[axis] = 1.0;
      const Joints ahead = *to_joints(machine, moved(p, u, kStep_mm));
      const Joints behind = *to_joints(machine, moved(p, u, -kStep_mm));
      for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(J[i][axis], (ahead[i] - behind[i]) / (2.0 * kStep_mm), 1e-6);
      }
    }
    const Point v = speeds.place(random);
    const Point a = accels.place(random);
    const auto at = [&](double t) {
      return *to_joints(machine, moved(moved(p, v, t), a, 0.5 * t * t));
    };
    const Joints before = at(-kStep_s);
    const Joints now = at(0.0);
    const Joints after = at(kStep_s);
    const Joints speed = joint_velocity(machine, p, v);
    const Joints accel = joint_acceleration(machine, p, v, a);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(speed[i], (after[i] - before[i]) / (2.0 * kStep_s), 1e-3);
      const double difference = (after[i] - 2.0 * now[i] + before[i]) / (kStep_s * kStep_s);
      EXPECT_NEAR(accel[i], difference, 1e-5 * std::max(1000.0, std::abs(accel[i])));
    }
  }
}

}  // namespace unflex::kinematics
