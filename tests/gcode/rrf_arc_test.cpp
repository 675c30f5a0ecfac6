// G2 and G3 as RepRapFirmware's DoArcMove cuts them, against numbers from its rules.
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

InterpreterOptions rrf() { return default_options(Firmware::rrf); }

TEST(RrfArc, HasPiecesThatStrayFiveMicrometres) {
  Session session(rrf());
  // √(8 · 10 · 0.005) = 0.632 mm; a quarter is 15.7 mm: ⌊24.84 + 0.8⌋ = 25.
  const Event event = session.read("M83\nG1 X10 Y0 Z1 F12000\nG3 X0 Y10 I-10 E2.5 Z2");
  expect_arc(event, {0.0, 0.0, 10.0, pi / 2.0, 25});
  EXPECT_EQ(event.segments.back().end_mm, (Position{0.0, 10.0, 2.0, 2.5}));
  EXPECT_DOUBLE_EQ(event.segments[3].feed_mm_s, 200.0);
}

TEST(RrfArc, HasTwoHundredPiecesASecondWhereItIsSlow) {
  Session session(rrf());
  // 20 mm/s: 0.1 mm; a half circle of 10 mm is 31.416 mm: ⌊314.16 + 0.8⌋ = 314.
  expect_arc(session.read("G1 X10 Y0 Z0 F1200\nG2 X-10 Y0 I-10"), {0.0, 0.0, 10.0, -pi, 314});
  // M220 makes it 40 mm/s: 0.2 mm, ⌊157.08 + 0.8⌋.
  EXPECT_THAT(session.read("M220 S200\nG2 X10 Y0 I10").segments, SizeIs(157));
  // 1 mm/s would be 5 µm, but a piece is at least 0.02 mm: ⌊1570.8 + 0.8⌋.
  EXPECT_THAT(session.read("M220 S100\nG2 X-10 Y0 I-10 F60").segments, SizeIs(1571));
}

TEST(RrfArc, HasNoPieceLongerThanAMillimetre) {
  Session session(rrf());
  // √(8 · 100 · 0.005) = 2 mm, cut to 1: a quarter of 100 mm is 157.08 mm.
  expect_arc(session.read("G1 X100 Y0 Z0 F30000\nG3 X0 Y100 I-100"),
             {0.0, 0.0, 100.0, pi / 2.0, 157});
}

TEST(RrfArc, IsAFullCircleWhereItEndsAtItsStart) {
  Session session(rrf());
  // 62.83 mm / 0.6325 mm = 99.35, + 0.8.
  expect_arc(session.read("G1 X10 Y0 Z0 F30000\nG3 I-10"), {0.0, 0.0, 10.0, 2.0 * pi, 100});
  expect_arc(session.read("G2 X10 Y0 I-10"), {0.0, 0.0, 10.0, -2.0 * pi, 100});
}

TEST(RrfArc, GivenByItsRadiusTakesTheShortOrTheLongWay) {
  Session session(rrf());
  session.read("G1 X10 Y0 Z0 F30000");
  expect_arc(session.read("G3 X0 Y10 R10"), {0.0, 0.0, 10.0, pi / 2.0, 25});
  session.read("G1 X10 Y0");
  // 47.12 mm / 0.6325 mm = 74.5, + 0.8.
  expect_arc(session.read("G3 X0 Y10 R-10"), {10.0, 10.0, 10.0, 1.5 * pi, 75});
}

TEST(RrfArc, AcceptsARadiusThatIsOnePercentTooShort) {
  Session session(rrf());
  session.read("G1 X10 Y0 Z0");
  EXPECT_EQ(session.read("G3 X-10 Y0 R9.95").kind, EventKind::move);
  EXPECT_EQ(session.read("G3 X10 Y0 R9.8").kind, EventKind::barrier);
}

TEST(RrfArc, IsReadInRelativeModeAndInOtherPlanes) {
  Session session(rrf());
  session.read("G1 X10 Y0 Z0 F30000\nG91");
  expect_arc(session.read("G3 X-10 Y10 I-10"), {0.0, 0.0, 10.0, pi / 2.0, 25});
  session.read("G90\nG1 X0 Y0 Z10\nG18");
  // Z to X is anticlockwise.
  const Event event = session.read("G3 X10 Z0 K-10");
  ASSERT_THAT(event.segments, SizeIs(25));
  const Position& middle = event.segments[11].end_mm;
  EXPECT_NEAR(std::hypot(middle[X], middle[Z]), 10.0, 1e-9);
  EXPECT_GT(middle[X], 0.0);
  EXPECT_GT(middle[Z], 0.0);
}

// DoArcMove does not read them. Slicers write P1 behind a lift, for Marlin.
TEST(RrfArc, TakesNoNoticeOfLettersThatTheFirmwareDoesNotRead) {
  const Session plain(rrf());
  for (const char* words : {" P1", " S1", " P1 S0.5"}) {
    Session session(rrf());
    const std::string arc = "G1 X10 Y0 Z1 F12000\nG3 Z1.4 I1.217 J0 F12000";
    const Event event = session.read(arc + words);
    EXPECT_EQ(event.kind, EventKind::move) << words;
    EXPECT_THAT(event.warnings, ::testing::IsEmpty());
    Session other(rrf());
    const Event expected = other.read(arc);
    ASSERT_EQ(event.segments.size(), expected.segments.size());
    EXPECT_EQ(event.segments.back().end_mm, expected.segments.back().end_mm);
  }
}

TEST(RrfArc, WithAFurtherAxisNamesItAndCountsItsPath) {
  for (const char* letter : {"A", "B", "C", "D", "U", "V", "W"}) {
    Session session(rrf());
    const Event event =
        session.read(std::string("M83\nG1 X10 Y0 Z0\nG3 X-10 I-10 E1 ") + letter + "5");
    EXPECT_TRUE(event.position_lost) << letter;
    ASSERT_THAT(event.warnings, SizeIs(1)) << letter;
    EXPECT_THAT(event.warnings[0], ::testing::HasSubstr(std::string("G3 with ") + letter));
    EXPECT_DOUBLE_EQ(event.lost_path_mm, 20.0);
  }
  Session session(rrf());
  EXPECT_THAT(session.read("M83\nG1 X10 Y0 Z0\nG1 X20 U5 E1").warnings, SizeIs(1));
}

TEST(RrfArc, WithoutACentreOrInInverseTimeIsNotRewritten) {
  for (const char* line : {"G2 X5 Y5", "G2 X5 I0", "G2 X10 R5", "G93\nG2 X5 I1 F2"}) {
    Session session(rrf());
    const Event event = session.read(std::string("G1 X10 Y0 Z0\n") + line);
    EXPECT_EQ(event.kind, EventKind::barrier) << line;
    EXPECT_TRUE(event.position_lost) << line;
  }
}

TEST(RrfArc, KeepsItsRuleForRandomArcs) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int i = 0; i < 500; ++i) {
    const double radius = 0.2 + 60.0 * unit(random) * unit(random);
    const double from = 2.0 * pi * unit(random);
    const double angle = 0.05 + 6.1 * unit(random);
    const bool clockwise = unit(random) < 0.5;
    const double feed = 2.0 + 200.0 * unit(random);
    const double turn = clockwise ? -angle : angle;
    const double length = std::clamp(std::min(std::sqrt(0.04 * radius), feed / 200.0), 0.02, 1.0);
    const double count = radius * angle / length + 0.8;
    if (std::abs(count - std::round(count)) < 1e-3) {
      continue;  // 32 bits may round it either way
    }
    Session session(rrf());
    session.read(fmt::format("G1 X{:.9f} Y{:.9f} Z0 F{:.9f}", radius * std::cos(from),
                             radius * std::sin(from), feed * 60.0));
    const Event event = session.read(
        fmt::format("{} X{:.9f} Y{:.9f} I{:.9f} J{:.9f} Z1 E2", clockwise ? "G2" : "G3",
                    radius * std::cos(from + turn), radius * std::sin(from + turn),
                    -radius * std::cos(from), -radius * std::sin(from)));
    expect_arc(event, {0.0, 0.0, radius, turn,
                       std::max<std::size_t>(1, static_cast<std::size_t>(count)), 1e-6});
  }
}

}  // namespace
}  // namespace unflex::gcode
