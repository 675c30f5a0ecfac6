#include "unflex/dynamics/node_map.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace unflex::dynamics {
namespace {

// A base that jerks at random from node to node.
AxisTrajectory shaken(double period_s, std::size_t nodes, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  AxisTrajectory base{{120.0}, {30.0}, {500.0}};
  for (std::size_t k = 0; k + 1 < nodes; ++k) {
    base.accel_mm_s2.push_back(8e3 * uniform(random));
    base.position_mm.push_back(0.0);
    base.velocity_mm_s.push_back(0.0);
    const AxisMotion end = between(base, k, period_s, period_s);
    base.position_mm[k + 1] = end.position_mm;
    base.velocity_mm_s[k + 1] = end.velocity_mm_s;
  }
  return base;
}

// Many short steps under even acceleration come to the same.
TEST(NodeMap, IsTheLimitOfManyShortSteps) {
  constexpr int kParts = 400;
  std::mt19937_64 random(1);
  const std::array three = {Mode{250.0, 0.05, 0.7}, Mode{400.0, 0.0, 0.5}, Mode{700.0, 1.5, -0.2}};
  const std::array leading = {Mode{282.0, 0.06, 0.6, 2e-4}, Mode{690.0, 0.1, 0.4, -2e-4}};
  for (const FlexibleAxis& axis :
       {FlexibleAxis(282.7, 0.06), FlexibleAxis(three), FlexibleAxis(leading)}) {
    for (const double period_s : {2e-4, 1e-3}) {
      AxisTrajectory base = shaken(period_s, 30, random);
      NozzleState state = axis.riding(119.9, 25.0);
      NozzleState stepped = state;
      const NodeMap map(axis, period_s);
      // The nozzle does not notice a jump of the base at once.
      base.position_mm[12] += 0.3;
      for (std::size_t k = 0; k + 1 < base.position_mm.size(); ++k) {
        map.advance(base, k, state);
        const double dt = period_s / kParts;
        for (int i = 0; i < kParts; ++i) {
          const AxisMotion from = between(base, k, i * dt, period_s);
          const double accel = between(base, k, (i + 0.5) * dt, period_s).accel_mm_s2;
          stepped = exact_step(axis, stepped, {from.position_mm, from.velocity_mm_s, accel}, dt);
        }
        EXPECT_NEAR(state.position(), stepped.position(), 1e-7);
        EXPECT_NEAR(state.velocity(), stepped.velocity(), 1e-4);
      }
    }
  }
}

}  // namespace
}  // namespace unflex::dynamics
