#include "shaped_base.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

namespace unflex::verify {
namespace {

using planner::PlannedMove;

// A straight move from rest to rest.
PlannedMove move_to(double from_x, double from_y, double to_x, double to_y, double accel_mm_s2,
                    double cruise_mm_s) {
  PlannedMove move;
  move.segment.start_mm = {from_x, from_y, 0.2, 0.0};
  move.segment.end_mm = {to_x, to_y, 0.2, 0.0};
  move.length_mm = std::hypot(to_x - from_x, to_y - from_y);
  move.direction = {(to_x - from_x) / move.length_mm, (to_y - from_y) / move.length_mm, 0.0, 0.0};
  move.accel_mm_s2 = accel_mm_s2;
  move.cruise_v_mm_s = std::min(cruise_mm_s, std::sqrt(accel_mm_s2 * move.length_mm));
  move.accel_s = move.decel_s = move.cruise_v_mm_s / accel_mm_s2;
  move.cruise_s = move.length_mm / move.cruise_v_mm_s - move.accel_s;
  return move;
}

class Shaped : public ::testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    std::mt19937 random(static_cast<unsigned>(GetParam()));
    std::uniform_real_distribution<double> place(10.0, 40.0);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    shaping_.x = *dynamics::shaper_pulses(dynamics::ShaperKind::mzv, 45.0, 0.1);
    if (GetParam() % 2 == 0) {
      shaping_.y = *dynamics::shaper_pulses(dynamics::ShaperKind::zvd, 30.0, 0.05);
    }
    double x = 20.0;
    double y = 30.0;
    for (int i = 0; i < 12; ++i) {
      // Some are far shorter than the pulses are apart.
      const double reach = i % 3 == 0 ? 0.02 : 1.0;
      const double to_x = x + reach * (place(random) - x);
      const double to_y = y + reach * (place(random) - y);
      moves_.push_back(move_to(x, y, to_x, to_y, 500.0 + 9000.0 * share(random), 150.0));
      x = to_x;
      y = to_y;
    }
  }

  [[nodiscard]] double planned(double t, gcode::Axis axis) const {
    t = std::max(t, 0.0);
    for (const PlannedMove& move : moves_) {
      if (t <= move.duration_s()) {
        return move.position_mm(t)[axis];
      }
      t -= move.duration_s();
    }
    return moves_.back().segment.end_mm[axis];
  }

  // Σ A_i b(t − t_i)
  [[nodiscard]] double convolved(double t, const dynamics::ShaperPulses& pulses,
                                 gcode::Axis axis) const {
    if (pulses.empty()) {
      return planned(t, axis);
    }
    double sum = 0.0;
    for (const dynamics::Pulse& pulse : pulses) {
      sum += pulse.weight * planned(t - pulse.time_s, axis);
    }
    return sum;
  }

  // From the first pulse of both axes to the last, the plan itself counted as one.
  [[nodiscard]] double memory_s() const {
    double last_s = 0.0;
    for (const dynamics::ShaperPulses* pulses : {&shaping_.x, &shaping_.y}) {
      last_s = pulses->empty() ? last_s : std::max(last_s, pulses->back().time_s);
    }
    return shaping_.lead_s() + last_s;
  }

  planner::Shaping shaping_;
  std::vector<PlannedMove> moves_;
};

double at(const dynamics::BaseSegment& base, double h) {
  return base.position + h * (base.velocity + 0.5 * h * base.acceleration);
}

TEST_P(Shaped, IsTheWeightedSumOfShiftedMotions) {
  ShapedBase base(shaping_, {20.0, 30.0});
  std::vector<BasePhase> phases;
  double given_s = 0.0;
  for (const PlannedMove& move : moves_) {
    base.add(move, phases);
    given_s += move.duration_s();
    double known_s = 0.0;
    for (const BasePhase& phase : phases) {
      known_s += phase.duration_s;
    }
    EXPECT_NEAR(known_s, given_s, 1e-9) << "as much is known as was given";
  }
  EXPECT_NEAR(base.unplayed_s(), base.lead_s(), 1e-12);
  std::vector<BasePhase> behind;
  base.finish(phases, behind);
  double t = -base.lead_s();
  for (const BasePhase& phase : phases) {
    t += phase.duration_s;
  }
  EXPECT_NEAR(t, given_s, 1e-9) << "until the plan's end";
  phases.insert(phases.end(), behind.begin(), behind.end());
  t = -base.lead_s();
  bool begins = false;
  for (const BasePhase& phase : phases) {
    begins = begins || std::abs(t) < 1e-9;
    for (const double share : {0.0, 0.3, 1.0}) {
      const double h = share * phase.duration_s;
      EXPECT_NEAR(at(phase.xy.x, h), convolved(t + h, shaping_.x, gcode::X), 1e-8) << t + h;
      EXPECT_NEAR(at(phase.xy.y, h), convolved(t + h, shaping_.y, gcode::Y), 1e-8) << t + h;
    }
    t += phase.duration_s;
  }
  EXPECT_TRUE(begins) << "a phase begins where the plan does";
  EXPECT_NEAR(t + base.lead_s(), given_s + memory_s(), 1e-9);
  EXPECT_NEAR(at(phases.back().xy.x, phases.back().duration_s), moves_.back().segment.end_mm[0],
              1e-8);
  EXPECT_NEAR(at(phases.back().xy.y, phases.back().duration_s), moves_.back().segment.end_mm[1],
              1e-8);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Shaped, ::testing::Range(1, 9));

TEST(ShapedBase, WithoutPulsesIsThePlan) {
  const PlannedMove move = move_to(1.0, 2.0, 31.0, 2.0, 3000.0, 120.0);
  ShapedBase base({}, {1.0, 2.0});
  std::vector<BasePhase> shaped;
  base.add(move, shaped);
  base.finish(shaped, shaped);
  std::vector<BasePhase> planned;
  append_phases(move, move.segment.delta(gcode::E), planned);
  ASSERT_EQ(shaped.size(), planned.size());
  for (std::size_t i = 0; i < shaped.size(); ++i) {
    EXPECT_NEAR(shaped[i].duration_s, planned[i].duration_s, 1e-9);
    EXPECT_NEAR(shaped[i].xy.x.position, planned[i].xy.x.position, 1e-9);
    EXPECT_NEAR(shaped[i].xy.x.velocity, planned[i].xy.x.velocity, 1e-6);
  }
}

TEST(ShapedBase, DoesNotShapeFilament) {
  PlannedMove move = move_to(1.0, 2.0, 31.0, 2.0, 3000.0, 120.0);
  move.segment.end_mm[gcode::E] = 1.5;
  planner::Shaping shaping;
  shaping.x = *dynamics::shaper_pulses(dynamics::ShaperKind::ei, 45.0, 0.1);
  ShapedBase base(shaping, {1.0, 2.0});
  std::vector<BasePhase> phases;
  base.add(move, phases);
  std::vector<BasePhase> behind;
  base.finish(phases, behind);
  double t = -base.lead_s();
  double extruding_s = 0.0;
  for (const BasePhase& phase : phases) {
    const double laid_mm = t < 0.0 ? 0.0 : 1.5 * move.distance_mm(t) / move.length_mm;
    EXPECT_NEAR(phase.e.position, laid_mm, 1e-9) << t;
    EXPECT_EQ(phase.extruding, t > -1e-9) << t;
    extruding_s += phase.extruding ? phase.duration_s : 0.0;
    t += phase.duration_s;
  }
  EXPECT_NEAR(extruding_s, move.duration_s(), 1e-9);
  EXPECT_DOUBLE_EQ(base.filament_mm(), 1.5);
}

}  // namespace
}  // namespace unflex::verify
