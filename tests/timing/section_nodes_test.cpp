#include "section_nodes.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tours.hpp"

namespace unflex::timing {
namespace {

using compensate::testing::plan;
using compensate::testing::planner_limits;
using compensate::testing::Point;
using testing::bounds_of;
using testing::kTolerance_mm;
using testing::Moves;
using testing::section_along;
using testing::setup;

constexpr double kNode_s = 1.6e-3;

double u_of(const SectionNodes::Pin& pin) { return static_cast<double>(pin.k) + pin.x; }

TEST(SectionNodes, AreEvenlySpreadOverTheFirstPlan) {
  const Section section = section_along({{1.0, 2.0}, {11.0, 2.0}, {11.0, 12.0}}, 100.0);
  const SectionNodes nodes(section, kNode_s);
  const double duration_s = section.legs[0].move.duration_s() + section.legs[1].move.duration_s();
  EXPECT_NEAR(nodes.period_s(), kNode_s, 0.01 * kNode_s);
  EXPECT_NEAR(nodes.period_s() * static_cast<double>(nodes.periods()), duration_s, 1e-12);
  EXPECT_NEAR(nodes.place(0).x, 1.0, 1e-12);
  EXPECT_NEAR(nodes.place(0).y, 2.0, 1e-12);
  EXPECT_NEAR(nodes.place(nodes.periods()).x, 11.0, 1e-9);
  EXPECT_NEAR(nodes.place(nodes.periods()).y, 12.0, 1e-9);
  const gcode::Position at = section.legs[0].move.position_mm(10.0 * nodes.period_s());
  EXPECT_NEAR(nodes.place(10).x, at[gcode::X], 1e-9);
}

TEST(SectionNodes, BeginAShortSectionMoreSlowly) {
  const Section section = section_along({{0.0, 0.0}, {0.2, 0.0}}, 100.0);
  const SectionNodes nodes(section, kNode_s);
  EXPECT_LT(section.legs[0].move.duration_s(), 10.0 * kNode_s);
  EXPECT_EQ(nodes.period_s(), kNode_s);
  EXPECT_GT(nodes.periods(), 14U);
  EXPECT_NEAR(nodes.place(nodes.periods()).x, 0.2, 1e-9);
}

TEST(SectionNodes, BindACornerToItsMoment) {
  const Section section = section_along({{0.0, 0.0}, {10.0, 0.0}, {10.0, 6.0}}, 100.0);
  const SectionNodes nodes(section, kNode_s);
  ASSERT_EQ(nodes.pins().size(), 1U);
  const SectionNodes::Pin& pin = nodes.pins().front();
  EXPECT_EQ(pin.vertex, 1U);
  EXPECT_GE(pin.x, 0.0);
  EXPECT_LT(pin.x, 1.0);
  EXPECT_NEAR(u_of(pin), section.legs[0].move.duration_s() / nodes.period_s(), 1e-9);
  // The first plan is at the corner then.
  EXPECT_LE(nodes.place(pin.k).x, 10.0 + 1e-12);
  EXPECT_NEAR(nodes.place(pin.k).y, 0.0, 1e-12);
  EXPECT_NEAR(nodes.place(pin.k + 1).x, 10.0, 1e-12);
  EXPECT_TRUE(nodes.is_near_vertex(1, pin.k, 0.0));
  EXPECT_TRUE(nodes.is_near_vertex(1, pin.k + 2, 0.0));
  EXPECT_FALSE(nodes.is_near_vertex(1, pin.k - 3, 0.0));
  EXPECT_FALSE(nodes.is_near_vertex(1, pin.k + 4, 0.0));
  // The ends of the section are no corners.
  EXPECT_FALSE(nodes.is_near_vertex(0, 0, 0.0));
  EXPECT_FALSE(nodes.is_near_vertex(2, nodes.periods(), 0.0));
}

TEST(SectionNodes, TakeTheLegOfTheMomentAtACorner) {
  const Section section = section_along({{0.0, 0.0}, {10.0, 0.0}, {10.0, 10.0}}, 100.0);
  const SectionNodes nodes(section, kNode_s);
  const SectionNodes::Pin& pin = nodes.pins().front();
  for (const XY nozzle : {XY{9.0, 0.1}, XY{10.1, 1.0}}) {
    EXPECT_EQ(nodes.nearest_leg(pin.k - 1, 0.5, nozzle), 0U);
    EXPECT_EQ(nodes.nearest_leg(pin.k, pin.x - 1e-9, nozzle), 0U);
    EXPECT_EQ(nodes.nearest_leg(pin.k, pin.x + 1e-9, nozzle), 1U);
    EXPECT_EQ(nodes.nearest_leg(pin.k + 1, 0.5, nozzle), 1U);
  }
  // Far from the corner the nozzle is as far from the path as from the leg of the moment; near it,
  // from the nearer one.
  EXPECT_NEAR(nodes.error_mm(2, 0.0, {10.0, 5.0}), 5.0, 1e-12);
  EXPECT_NEAR(nodes.error_mm(pin.k - 1, 0.0, {10.1, 1.0}), 0.1, 1e-12);
  EXPECT_NEAR(nodes.error_mm(pin.k + 1, 0.5, {9.0, 0.1}), 0.1, 1e-12);
  EXPECT_NEAR(nodes.along_mm(0, {4.0, 3.0}), 4.0, 1e-12);
  EXPECT_NEAR(nodes.along_mm(0, {-4.0, 3.0}), 0.0, 1e-12);
  EXPECT_NEAR(nodes.along_mm(1, {4.0, 13.0}), 10.0, 1e-12);
}

TEST(SectionNodes, BindAnArcEveryFewDegrees) {
  constexpr double kDegree = std::numbers::pi / 180.0;
  constexpr double kRadius_mm = 50.0;
  for (const double step_deg : {0.9, 1.5, 3.2}) {
    std::vector<Point> points;
    for (double angle_deg = 0.0; angle_deg < 90.0; angle_deg += step_deg) {
      points.push_back(
          {kRadius_mm * std::cos(angle_deg * kDegree), kRadius_mm * std::sin(angle_deg * kDegree)});
    }
    const Section section = section_along(points, 100.0);
    ASSERT_EQ(section.legs.size(), points.size() - 1);
    const SectionNodes nodes(section, kNode_s);
    std::size_t last = 0;
    double last_u = 0.0;
    for (const SectionNodes::Pin& pin : nodes.pins()) {
      const double turned_deg = static_cast<double>(pin.vertex - last) * step_deg;
      EXPECT_GT(turned_deg, 5.0) << step_deg;
      EXPECT_LT(turned_deg, 5.01 + step_deg) << step_deg;
      EXPECT_GT(u_of(pin), last_u);
      last = pin.vertex;
      last_u = u_of(pin);
    }
    EXPECT_LT(static_cast<double>(section.legs.size() - last) * step_deg, 5.01 + step_deg);
    // Between bound vertices a place belongs to the leg that is nearest.
    const SectionNodes::Pin& first = nodes.pins()[0];
    const SectionNodes::Pin& second = nodes.pins()[1];
    const double u = 0.5 * (u_of(first) + u_of(second));
    const auto k = static_cast<std::size_t>(u);
    for (std::size_t leg = first.vertex; leg < second.vertex; ++leg) {
      const gcode::Position middle =
          section.legs[leg].move.position_mm(0.5 * section.legs[leg].move.duration_s());
      EXPECT_EQ(
          nodes.nearest_leg(k, u - static_cast<double>(k), {middle[gcode::X], middle[gcode::Y]}),
          leg);
    }
  }
}

TEST(SectionNodes, LeaveOfTheToleranceWhatALegIsAwayFromItsMoves) {
  Section section = section_along({{0.0, 0.0}, {10.0, 0.0}, {10.0, 10.0}}, 100.0);
  const double tolerance_mm = section.legs[1].tolerance_mm;
  section.legs[1].bulge_mm = 1e-3;
  const SectionNodes nodes(section, kNode_s);
  EXPECT_EQ(nodes.tolerance_mm(0, 3, 0.0), tolerance_mm);
  EXPECT_NEAR(nodes.tolerance_mm(1, nodes.periods() - 3, 0.0), tolerance_mm - 1e-3, 1e-12);
}

TEST(SectionNodes, LetTravelBesideFilamentDoWhatFilamentMay) {
  const Moves moves = plan({{0.0, 0.0}, {10.0, 0.0}, {20.0, 0.0, false}, {30.0, 0.0}},
                           planner_limits(100.0, 2000.0, 5.0));
  std::vector<MoveBounds> bounds = bounds_of(moves);
  bounds[0].nozzle_speed_mm_s = 60.0;
  const Section section = sections(moves, bounds, setup(), 100.0)->front().section;
  const SectionNodes nodes(section, kNode_s);
  ASSERT_EQ(nodes.pins().size(), 2U);
  const double begins_u = u_of(nodes.pins()[0]);
  const double ends_u = u_of(nodes.pins()[1]);
  for (double u = begins_u; u < ends_u; u += 0.25) {
    const auto k = static_cast<std::size_t>(u);
    const double x = u - static_cast<double>(k);
    const double away = std::min(u - begins_u, ends_u - u);
    EXPECT_EQ(nodes.tolerance_mm(1, k, x), away <= 2.5 ? kTolerance_mm : kTravelTolerance_mm) << u;
    EXPECT_EQ(nodes.feed_mm_s(1, k, x), u - begins_u <= 1.5 ? 60.0 : 100.0) << u;
    EXPECT_EQ(nodes.tolerance_mm(0, k, x), kTolerance_mm);
    EXPECT_EQ(nodes.feed_mm_s(0, k, x), 60.0);
  }
}

}  // namespace
}  // namespace unflex::timing
