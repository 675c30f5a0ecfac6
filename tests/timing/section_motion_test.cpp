#include "section_motion.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "section_nodes.hpp"
#include "tours.hpp"

namespace unflex::timing {
namespace {

using compensate::testing::plan;
using compensate::testing::planner_limits;
using testing::bounds_of;
using testing::distance_mm;
using testing::kMotors_mm_s2;
using testing::kTolerance_mm;
using testing::Moves;
using testing::section_along;
using testing::setup;

constexpr double kFeed_mm_s = 100.0;
constexpr double kSample_s = 1e-4;

SectionRules rules() {
  SectionRules result;
  result.x = result.y = setup().x.axis.main();
  result.max_accel_mm_s2 = kMotors_mm_s2;
  return result;
}

Section corner() { return section_along({{0.0, 0.0}, {10.0, 0.0}, {10.0, 10.0}}, kFeed_mm_s); }

// What a nozzle does on the base of a motion, and the base itself.
struct Followed {
  double error_mm = 0.0;
  double speed_mm_s = 0.0;
  XY accel_mm_s2;
  double accel_motors_mm_s2 = 0.0;  // |ẍ| + |ÿ|
  double slip_mm_s = 0.0;           // between the speed that the base tells and that of its places
  double last_x_mm = 0.0;
};

using BothAxes = Axes<dynamics::FlexibleAxis>;

BothAxes axes(double factor = 1.0) { return on_all_axes(setup().x.axis.detuned(factor)); }

Followed follow(const Section& section, const SectionMotion& motion, const BothAxes& axes,
                dynamics::NozzleXY nozzle) {
  Followed result;
  const auto steps = static_cast<std::size_t>(std::ceil(motion.duration_s() / kSample_s));
  const double step_s = motion.duration_s() / static_cast<double>(steps);
  SectionMotion::Base before = motion.base(0.0);
  for (std::size_t i = 1; i <= steps; ++i) {
    const SectionMotion::Base after = motion.base(static_cast<double>(i) * step_s);
    const auto between = [&](const SectionMotion::OfAxis& from, const SectionMotion::OfAxis& to) {
      result.slip_mm_s =
          std::max(result.slip_mm_s, std::abs((to.position_mm - from.position_mm) / step_s -
                                              0.5 * (from.velocity_mm_s + to.velocity_mm_s)));
      return dynamics::BaseSegment{from.position_mm, from.velocity_mm_s,
                                   (to.velocity_mm_s - from.velocity_mm_s) / step_s};
    };
    const Axes<dynamics::BaseSegment> base = map_axes(between, before, after);
    for_each_axis(
        [&](dynamics::NozzleState& state, const dynamics::FlexibleAxis& axis,
            const dynamics::BaseSegment& segment) {
          state = dynamics::rk4_step(axis, state, segment, step_s);
        },
        nozzle, axes, base);
    double least_mm = std::numeric_limits<double>::infinity();
    for (const Leg& leg : section.legs) {
      least_mm =
          std::min(least_mm, distance_mm(leg.move, nozzle.x.position(), nozzle.y.position()));
    }
    result.error_mm = std::max(result.error_mm, least_mm);
    const XY velocity =
        map_axes([](const dynamics::NozzleState& state) { return state.velocity(); }, nozzle);
    result.speed_mm_s = std::max(result.speed_mm_s, length(velocity));
    const XY accel = map_axes(
        [](const dynamics::BaseSegment& segment) { return std::abs(segment.acceleration); }, base);
    for_each_axis([](double& most, double now) { most = std::max(most, now); }, result.accel_mm_s2,
                  accel);
    result.accel_motors_mm_s2 = std::max(result.accel_motors_mm_s2, taxicab(accel));
    before = after;
  }
  result.last_x_mm = nozzle.x.position();
  return result;
}

Followed follow(const Section& section, const SectionMotion& motion, double factor = 1.0) {
  const XY start = start_of(section.legs.front());
  return follow(section, motion, axes(factor), {{start.x, 0.0}, {start.y, 0.0}});
}

double length_mm(const Section& section) {
  double sum = 0.0;
  for (const Leg& leg : section.legs) {
    sum += leg.move.length_mm;
  }
  return sum;
}

TEST(SectionMotion, KeepsTheRulesAroundACorner) {
  const Section section = corner();
  const auto motion = fastest_motion(section, rules());
  ASSERT_TRUE(motion);
  const Followed followed = follow(section, *motion);
  EXPECT_LT(followed.error_mm, 1.05 * kTolerance_mm);
  EXPECT_LT(followed.speed_mm_s, 1.02 * kFeed_mm_s);
  EXPECT_LT(followed.accel_mm_s2.x, 1.03 * kMotors_mm_s2);
  EXPECT_LT(followed.accel_mm_s2.y, 1.03 * kMotors_mm_s2);
  EXPECT_LT(followed.slip_mm_s, 0.1);
  EXPECT_GT(motion->duration_s(), length_mm(section) / kFeed_mm_s);
}

TEST(SectionMotion, UsesWhatTheRulesAllow) {
  const Section section = corner();
  const auto motion = fastest_motion(section, rules());
  ASSERT_TRUE(motion);
  const Followed followed = follow(section, *motion);
  EXPECT_GT(followed.error_mm, 0.9 * kTolerance_mm);
  EXPECT_GT(followed.speed_mm_s, 0.98 * kFeed_mm_s);
  EXPECT_GT(followed.accel_mm_s2.x, 0.9 * kMotors_mm_s2);
  // Less than a plan that stops at the corner takes with a shaper of two pulses.
  const double half_period_s = 0.5 / setup().x.axis.main_hz();
  EXPECT_LT(motion->duration_s(),
            length_mm(section) / kFeed_mm_s + 2.0 * kFeed_mm_s / kMotors_mm_s2 + half_period_s);
}

TEST(SectionMotion, IsAtRestAtBothEnds) {
  const auto motion = fastest_motion(corner(), rules());
  ASSERT_TRUE(motion);
  const SectionMotion::Base first = motion->base(0.0);
  const SectionMotion::Base last = motion->base(motion->duration_s());
  EXPECT_NEAR(first.x.position_mm, 0.0, 1e-6);
  EXPECT_NEAR(first.y.position_mm, 0.0, 1e-6);
  EXPECT_NEAR(last.x.position_mm, 10.0, 1e-6);
  EXPECT_NEAR(last.y.position_mm, 10.0, 1e-6);
  for (const SectionMotion::Base& base : {first, last}) {
    EXPECT_NEAR(base.x.velocity_mm_s, 0.0, 1e-3);
    EXPECT_NEAR(base.y.velocity_mm_s, 0.0, 1e-3);
  }
}

TEST(SectionMotion, PassesThePathInOrder) {
  const Section section = corner();
  const auto motion = fastest_motion(section, rules());
  ASSERT_TRUE(motion);
  const std::vector<Passage> passages = motion->passages();
  ASSERT_GT(passages.size(), 100U);
  EXPECT_EQ(passages.front().time_s, 0.0);
  EXPECT_EQ(passages.front().leg, 0U);
  EXPECT_NEAR(passages.front().along_mm, 0.0, 1e-9);
  EXPECT_NEAR(passages.back().time_s, motion->duration_s(), 1e-12);
  EXPECT_EQ(passages.back().leg, 1U);
  EXPECT_NEAR(passages.back().along_mm, 10.0, 1e-9);
  for (std::size_t i = 1; i < passages.size(); ++i) {
    const Passage& before = passages[i - 1];
    const Passage& after = passages[i];
    EXPECT_GT(after.time_s, before.time_s) << i;
    EXPECT_GE(after.leg, before.leg) << i;
    if (after.leg == before.leg) {
      EXPECT_GE(after.along_mm, before.along_mm - 1e-6) << i;
    }
  }
}

TEST(SectionMotion, TakesItsTimeForABandOfFrequencies) {
  const Section section = corner();
  const auto exact = fastest_motion(section, rules());
  ASSERT_TRUE(exact);
  const auto worst_mm = [&](const SectionMotion& motion) {
    return std::max(follow(section, motion, 0.95).error_mm, follow(section, motion, 1.05).error_mm);
  };
  EXPECT_GT(worst_mm(*exact), 1.6 * kTolerance_mm);
  for (const double times : {2.0, 1.2}) {
    SectionRules of_band = rules();
    for (const double factor : {0.95, 1.05}) {
      of_band.edges.push_back({axes(factor), on_all_axes(factor - 1.0)});
    }
    of_band.times_tolerance = times;
    const auto robust = fastest_motion(section, of_band);
    ASSERT_TRUE(robust) << times;
    EXPECT_GE(robust->duration_s(), exact->duration_s()) << times;
    EXPECT_LT(robust->duration_s(), 1.2 * exact->duration_s()) << times;
    EXPECT_LT(follow(section, *robust).error_mm, 1.05 * kTolerance_mm) << times;
    EXPECT_LT(worst_mm(*robust), 1.1 * times * kTolerance_mm) << times;
  }
}

// The nozzles of axes that are 5 % off swing on, and by how much is a matter of the acceleration
// before.
TEST(SectionMotion, LetsTheNozzlesOfABandSwingInTheEndByWhatTheyMay) {
  SectionRules of_band = rules();
  for (const double factor : {0.95, 1.05}) {
    of_band.edges.push_back({axes(factor), on_all_axes(factor - 1.0)});
  }
  Section section = section_along({{0.0, 0.0}, {6.0, 8.0}}, 1.5 * kFeed_mm_s);
  const auto swing_mm = [&](const SectionMotion& motion) {
    const SectionMotion::Base base = motion.base(motion.duration_s());
    double largest = 0.0;
    for (std::size_t i = 0; i < of_band.edges.size(); ++i) {
      const XY swing = map_axes(
          [](const dynamics::FlexibleAxis& axis, const dynamics::NozzleState& nozzle,
             const SectionMotion::OfAxis& at) {
            const auto gap = axis.gap(nozzle, axis.riding(at.position_mm));
            return std::hypot(gap.place_mm, gap.speed_mm);
          },
          of_band.edges[i], motion.edge_nozzles()[i], base);
      largest = std::max(largest, length(swing));
    }
    return largest;
  };
  const auto free = fastest_motion(section, of_band);
  ASSERT_TRUE(free);
  section.swing_tolerance_mm = 0.5 * swing_mm(*free);
  const auto calm = fastest_motion(section, of_band);
  ASSERT_TRUE(calm);
  EXPECT_LE(swing_mm(*calm), 1.03 * *section.swing_tolerance_mm);
  EXPECT_GT(calm->duration_s(), free->duration_s());
}

TEST(SectionMotion, IsTheSameWithXAndYExchanged) {
  const Section section = section_along({{0.0, 0.0}, {10.0, 1.0}, {12.0, 7.0}}, kFeed_mm_s);
  const Section exchanged = section_along({{0.0, 0.0}, {1.0, 10.0}, {7.0, 12.0}}, kFeed_mm_s);
  const auto a = fastest_motion(section, rules());
  const auto b = fastest_motion(exchanged, rules());
  ASSERT_TRUE(a && b);
  EXPECT_NEAR(a->duration_s(), b->duration_s(), 1e-6);
  for (double t = 0.0; t < a->duration_s(); t += 1e-3) {
    EXPECT_NEAR(a->base(t).x.position_mm, b->base(t).y.position_mm, 1e-4) << t;
    EXPECT_NEAR(a->base(t).y.position_mm, b->base(t).x.position_mm, 1e-4) << t;
  }
}

TEST(SectionMotion, KeepsTheBaseWhereItMayBe) {
  const Section section = corner();
  const auto farthest_mm = [](const SectionMotion& motion) {
    double most = -std::numeric_limits<double>::infinity();
    for (double t = 0.0; t < motion.duration_s(); t += kSample_s) {
      most = std::max(most, motion.base(t).x.position_mm);
    }
    return most;
  };
  const auto free = fastest_motion(section, rules());
  ASSERT_TRUE(free);
  const double free_mm = farthest_mm(*free);
  ASSERT_GT(free_mm, 10.04);
  SectionRules walled = rules();
  walled.limits.x.max_position_mm = 10.02;
  const auto motion = fastest_motion(section, walled);
  ASSERT_TRUE(motion);
  EXPECT_LT(farthest_mm(*motion), 10.02);
  EXPECT_GE(motion->duration_s(), free->duration_s());
  const Followed followed = follow(section, *motion);
  EXPECT_LT(followed.error_mm, 1.05 * kTolerance_mm);
  EXPECT_LT(followed.accel_mm_s2.x, 1.03 * kMotors_mm_s2);
}

TEST(SectionMotion, SharesMotors) {
  const Section section = section_along({{0.0, 0.0}, {7.0, 7.0}, {14.0, 0.0}}, kFeed_mm_s);
  SectionRules shared = rules();
  shared.shares_motors = true;
  const auto own = fastest_motion(section, rules());
  const auto motion = fastest_motion(section, shared);
  ASSERT_TRUE(own && motion);
  EXPECT_GT(follow(section, *own).accel_motors_mm_s2, 1.2 * kMotors_mm_s2);
  EXPECT_LT(follow(section, *motion).accel_motors_mm_s2, 1.03 * kMotors_mm_s2);
  EXPECT_GT(motion->duration_s(), own->duration_s());
}

// Strips along both legs alone would let the nozzle turn anywhere on them.
TEST(SectionMotion, GoesToTheVertexWhereThePathTurnsBack) {
  for (const double aside_mm : {0.0, 1e-3, 0.02, 0.2}) {
    const Section section =
        section_along({{0.0, 0.0}, {9.0, 0.0}, {8.5, aside_mm}, {8.5, 5.0}}, 120.0);
    ASSERT_EQ(section.legs.size(), 3U);
    const auto motion = fastest_motion(section, rules());
    ASSERT_TRUE(motion) << aside_mm;
    double most_mm = 0.0;
    for (const Passage& passage : motion->passages()) {
      if (passage.leg == 0) {
        most_mm = std::max(most_mm, passage.along_mm);
      }
    }
    EXPECT_GT(most_mm, 9.0 - (aside_mm == 0.0 ? 1.5 : 4.5) * kTolerance_mm) << aside_mm;
    EXPECT_LT(follow(section, *motion).error_mm, 1.05 * kTolerance_mm) << aside_mm;
  }
}

TEST(SectionMotion, BeginsWithANozzleThatSwings) {
  Section section = corner();
  dynamics::NozzleXY swinging;
  swinging.x.parts[0] = {0.0, 2.0};
  swinging.y.parts[0] = {0.6 * kTolerance_mm, 1.0};
  section.nozzle = dynamics::motion(swinging);
  const auto motion = fastest_motion(section, rules());
  ASSERT_TRUE(motion);
  const SectionMotion::Base first = motion->base(0.0);
  EXPECT_NEAR(first.x.position_mm, 0.0, 1e-6);
  EXPECT_NEAR(first.y.position_mm, 0.0, 1e-6);
  EXPECT_NEAR(first.x.velocity_mm_s, 0.0, 1e-3);
  EXPECT_NEAR(first.y.velocity_mm_s, 0.0, 1e-3);
  const Followed followed = follow(section, *motion, axes(), swinging);
  EXPECT_LT(followed.error_mm, 1.05 * kTolerance_mm);
  EXPECT_NEAR(followed.last_x_mm, 10.0, 0.1 * kTolerance_mm);
}

// Each axis lags behind by its own damping.
TEST(SectionMotion, IsOnThePathWhereItEndsEvenOnUnequalAxes) {
  const Moves moves = plan({{0.0, 0.0}, {30.0, 30.0}}, planner_limits(kFeed_mm_s, 2000.0, 5.0));
  const auto parts = sections(moves, bounds_of(moves), setup(), 0.03);
  ASSERT_EQ(parts->size(), 2U);
  SectionRules unequal = rules();
  unequal.y = {.omega_rad_s = 350.0, .zeta = 0.2};
  const BothAxes both = map_axes(
      [](const dynamics::Mode& mode) {
        return dynamics::FlexibleAxis(mode.omega_rad_s, mode.zeta);
      },
      unequal);
  const double even_mm_s = kFeed_mm_s * std::sqrt(0.5);
  const Section& first = parts->front().section;
  const auto to_even = fastest_motion(first, unequal);
  ASSERT_TRUE(to_even);
  const SectionMotion::Base last = to_even->base(to_even->duration_s());
  EXPECT_NEAR(last.x.position_mm, first.legs[0].move.segment.end_mm[gcode::X], 1e-3);
  EXPECT_NEAR(last.y.position_mm, first.legs[0].move.segment.end_mm[gcode::Y], 1e-3);
  EXPECT_NEAR(last.x.velocity_mm_s, even_mm_s, 0.1);
  EXPECT_NEAR(last.y.velocity_mm_s, even_mm_s, 0.1);
  const Section& second = parts->back().section;
  const auto from_even = fastest_motion(second, unequal);
  ASSERT_TRUE(from_even);
  const SectionMotion::Base begin = from_even->base(0.0);
  const XY start = start_of(second.legs[0]);
  EXPECT_NEAR(begin.x.position_mm, start.x, 1e-3);
  EXPECT_NEAR(begin.y.position_mm, start.y, 1e-3);
  const Followed followed =
      follow(second, *from_even, both,
             {both.x.riding(start.x, even_mm_s), both.y.riding(start.y, even_mm_s)});
  EXPECT_LT(followed.error_mm, 1.05 * kTolerance_mm);
}

}  // namespace
}  // namespace unflex::timing
