// G2 and G3 as Marlin's plan_arc cuts them, against numbers from its rules.
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "arc_expectation.hpp"

namespace unflex::gcode {
namespace {

using std::numbers::pi;
using ::testing::SizeIs;

InterpreterOptions marlin() { return default_options(Firmware::marlin); }

TEST(MarlinArc, HasPiecesOfAtMostOneMillimetre) {
  Session session(marlin());
  // A quarter of 20 mm: 31.4 mm; 31 pieces would be longer than 1 mm, so 32. At least 18 are
  // needed.
  const Event event = session.read("G90\nM83\nG1 X20 Y0 Z1 F1200\nG3 X0 Y20 I-20 J0 E3.1 Z2");
  expect_arc(event, {0.0, 0.0, 20.0, pi / 2.0, 32, 2e-4});
  EXPECT_DOUBLE_EQ(event.segments[7].feed_mm_s, 20.0);
  EXPECT_EQ(event.segments.back().end_mm, (Position{0.0, 20.0, 2.0, 3.1}));
}

TEST(MarlinArc, HasFiveDegreesAPieceWhereThatIsMore) {
  Session session(marlin());
  // 90° of 5 mm: 7.85 mm, so 18 pieces of 0.436 mm.
  expect_arc(session.read("G1 X5 Y0 Z0\nG3 X0 Y5 I-5"), {0.0, 0.0, 5.0, pi / 2.0, 18, 5e-4});
}

TEST(MarlinArc, HasNoPieceShorterThanTheLeastLength) {
  Session session(marlin());
  // A circle of 0.5 mm: 3.14 mm; 72 pieces would be 0.044 mm, so ⌊3.14 / 0.1⌋ = 31.
  const Event event = session.read("G1 X0.5 Y0 Z0\nG2 I-0.5");
  EXPECT_THAT(event.segments, SizeIs(31));
  // A circle of 0.01 mm is one piece, which leads nowhere.
  EXPECT_THAT(session.read("G2 I-0.01").segments, SizeIs(0));
}

TEST(MarlinArc, IsAFullCircleWhereItEndsAtItsStart) {
  for (const bool clockwise : {false, true}) {
    Session session(marlin());
    const Event event =
        session.read(std::string("G1 X10 Y0 Z0\n") + (clockwise ? "G2" : "G3") + " X10 Y0 I-10");
    // 62.8 mm: fewer than the 72 pieces of a circle.
    expect_arc(event, {0.0, 0.0, 10.0, clockwise ? -2.0 * pi : 2.0 * pi, 72, 1e-3});
  }
}

// sin θ ≈ θ − θ³/6, cos θ ≈ 1 − θ²/2: a step changes the radius by the factor
// √((1 − θ²/2)² + (θ − θ³/6)²), until the 25th point is computed anew.
TEST(MarlinArc, DriftsFromTheCircleBetweenCorrections) {
  Session session(marlin());
  const Event event = session.read("G1 X10 Y0 Z0\nG3 I-10");
  ASSERT_THAT(event.segments, SizeIs(72));
  const double theta = 2.0 * pi / 72.0;
  const double growth = std::hypot(1.0 - theta * theta / 2.0, theta - std::pow(theta, 3.0) / 6.0);
  const auto radius = [&](std::size_t n) {  // after n pieces
    return std::hypot(event.segments[n - 1].end_mm[X], event.segments[n - 1].end_mm[Y]);
  };
  EXPECT_NEAR(radius(24), 10.0 * std::pow(growth, 24.0), 1e-9);
  EXPECT_GT(std::abs(radius(24) - 10.0), 1e-4);
  EXPECT_NEAR(radius(25), 10.0, 1e-12);
  EXPECT_NEAR(radius(26), 10.0 * growth, 1e-9);
  EXPECT_NEAR(radius(50), 10.0, 1e-12);
}

TEST(MarlinArc, TakesSegmentsPerSecondWhereConfigured) {
  InterpreterOptions options = marlin();
  options.marlin_arcs.segments_per_s = 50.0;
  Session session(options);
  // 20 mm/s at 50 per second: 0.4 mm. A half circle of 20 mm: 62.83 mm, 157 pieces.
  EXPECT_THAT(session.read("G1 X20 Y0 Z0 F1200\nG3 X-20 Y0 I-20").segments, SizeIs(157));
  // M220 counts: 40 mm/s, 0.8 mm, 78 pieces.
  EXPECT_THAT(session.read("M220 S200\nG3 X20 Y0 I20").segments, SizeIs(78));
  // 200 mm/s would be 4 mm, which is cut to the longest length.
  EXPECT_THAT(session.read("G3 X-20 Y0 I-20 F6000").segments, SizeIs(63));
}

TEST(MarlinArc, GivenByItsRadiusTakesTheShortOrTheLongWay) {
  Session session(marlin());
  session.read("G1 X10 Y0 Z0");
  expect_arc(session.read("G3 X0 Y10 R10"), {0.0, 0.0, 10.0, pi / 2.0, 18, 1e-3});
  session.read("G1 X10 Y0");
  expect_arc(session.read("G3 X0 Y10 R-10"), {10.0, 10.0, 10.0, 1.5 * pi, 54, 1e-3});
  session.read("G1 X10 Y0");
  expect_arc(session.read("G2 X0 Y10 R10"), {10.0, 10.0, 10.0, -pi / 2.0, 18, 1e-3});
}

TEST(MarlinArc, MakesFullCirclesFirstWhereItReadsThem) {
  Session plain(marlin());
  EXPECT_THAT(plain.read("G1 X10 Y0 Z0\nG3 X0 Y10 I-10 P2").segments, SizeIs(18));
  InterpreterOptions options = marlin();
  options.marlin_arcs.circles = true;
  Session session(options);
  const Event event = session.read("M83\nG1 X10 Y0 Z0\nG3 X0 Y10 I-10 P2 Z4.5 E9");
  ASSERT_THAT(event.segments, SizeIs(2 * 72 + 18));
  // The arc has 900°, of which a circle is 2/5.
  const Position& once = event.segments[71].end_mm;
  EXPECT_NEAR(once[X], 10.0, 1e-9);
  EXPECT_NEAR(once[Y], 0.0, 1e-9);
  EXPECT_NEAR(once[Z], 4.5 * 360.0 / 810.0, 1e-9);
  EXPECT_NEAR(once[E], 9.0 * 360.0 / 810.0, 1e-9);
  EXPECT_EQ(event.segments.back().end_mm, (Position{0.0, 10.0, 4.5, 9.0}));
}

TEST(MarlinArc, IsReadInRelativeModeToo) {
  Session session(marlin());
  session.read("G1 X10 Y0 Z0\nG91");
  expect_arc(session.read("G3 X-10 Y10 I-10"), {0.0, 0.0, 10.0, pi / 2.0, 18, 1e-3});
}

TEST(MarlinArc, HintsItsRadiusToThePlannerBetweenItsEnds) {
  Session session(marlin());
  const Event event = session.read("G1 X10 Y0 Z0\nG3 X0 Y10 I-10");
  EXPECT_EQ(event.segments.front().curve_radius_mm, 0.0);
  EXPECT_EQ(event.segments[1].curve_radius_mm, 10.0);
  EXPECT_EQ(event.segments[16].curve_radius_mm, 10.0);
  EXPECT_EQ(event.segments.back().curve_radius_mm, 0.0);
  EXPECT_EQ(session.move("G1 X5").curve_radius_mm, 0.0);
}

TEST(MarlinArc, ThatMarlinMayReadOtherwiseIsNotRewritten) {
  for (const char* line : {"G2 X5 Y5", "G2 X5 I0 J0", "G18\nG2 X5 K3", "G2 I1 F"}) {
    Session session(marlin());
    const Event event = session.read(std::string("G1 X10 Y0 Z0\n") + line);
    EXPECT_EQ(event.kind, EventKind::barrier) << line;
    EXPECT_TRUE(event.position_lost) << line;
    EXPECT_THAT(event.warnings, SizeIs(1)) << line;
  }
}

// With the default lengths ⌊ℓ⌋ pieces are always too long, so n = ⌈ℓ / 1 mm⌉, or the least number
// per circle if that is more. If these pieces are too short, n = ⌊ℓ / 0.1 mm⌋.
double pieces(double radius, double angle) {
  const double flat = radius * angle;
  const double least = std::ceil(72.0 * angle / (2.0 * pi));
  if (flat / least < 0.1) {
    return std::max(1.0, std::floor(flat / 0.1));
  }
  return flat > least ? std::ceil(flat) : least;
}

bool near_whole(double value) { return std::abs(value - std::round(value)) < 1e-3; }

TEST(MarlinArc, KeepsItsRuleForRandomArcs) {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 500; ++i) {
    const double radius = 0.2 + 60.0 * unit(random) * unit(random);
    const double from = 2.0 * pi * unit(random);
    const double angle = 0.05 + 6.1 * unit(random);
    const bool clockwise = unit(random) < 0.5;
    const double turn = clockwise ? -angle : angle;
    const double flat = radius * angle;
    if (near_whole(flat) || near_whole(flat / 0.1) || near_whole(72.0 * angle / (2.0 * pi))) {
      continue;  // 32 bits may round it either way
    }
    Session session(marlin());
    session.read(
        fmt::format("G1 X{:.9f} Y{:.9f} Z0", radius * std::cos(from), radius * std::sin(from)));
    const Event event = session.read(
        fmt::format("{} X{:.9f} Y{:.9f} I{:.9f} J{:.9f} Z1 E2", clockwise ? "G2" : "G3",
                    radius * std::cos(from + turn), radius * std::sin(from + turn),
                    -radius * std::cos(from), -radius * std::sin(from)));
    const double count = pieces(radius, angle);
    const double theta = angle / count;
    // Up to 24 steps of −θ⁴/24 each in the radius and of θ⁵/30 in the angle.
    const double drift = 1e-6 + radius * (std::pow(theta, 4.0) + std::pow(theta, 5.0));
    expect_arc(event, {0.0, 0.0, radius, turn, static_cast<std::size_t>(count), drift});
  }
}

}  // namespace
}  // namespace unflex::gcode
