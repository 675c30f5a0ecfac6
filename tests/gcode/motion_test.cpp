// G0 to G3, and the other words of a motion line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(Segment, KnowsItsLengths) {
  const Segment segment{{1, 2, 3, 4}, {4, 6, 15, 5}, 10.0, 1, true};
  EXPECT_DOUBLE_EQ(segment.length_xy_mm(), 5.0);
  EXPECT_DOUBLE_EQ(segment.length_mm(), 13.0);
  EXPECT_DOUBLE_EQ(segment.delta(E), 1.0);
  EXPECT_TRUE(segment.extruding());
  EXPECT_FALSE((Segment{{0, 0, 0, 0}, {0, 0, 1, 1}, 1.0, 1, true}).extruding());
  EXPECT_FALSE((Segment{{0, 0, 0, 0}, {1, 0, 0, -1}, 1.0, 1, true}).extruding());
}

TEST(Moves, RunFromTheEndOfThePreviousOne) {
  Session session;
  const Segment first = session.move("G1 X10 Y20 Z.3 F7200");
  EXPECT_THAT(first.start_mm, ElementsAre(0, 0, 0, 0));
  EXPECT_THAT(first.end_mm, ElementsAre(10, 20, 0.3, 0));
  EXPECT_DOUBLE_EQ(first.feed_mm_s, 120.0);
  const Segment second = session.move("G0 X11 E1.5");
  EXPECT_THAT(second.start_mm, ElementsAre(10, 20, 0.3, 0));
  EXPECT_THAT(second.end_mm, ElementsAre(11, 20, 0.3, 1.5));
  EXPECT_DOUBLE_EQ(second.feed_mm_s, 120.0) << "F is modal and shared by G0 and G1";
}

TEST(Moves, WithoutLengthArePassive) {
  Session session;
  session.read("G1 X1 Y1 Z1 E1");
  for (const char* line : {"G1", "G1 F3000", "G1 X1 Y1", "G1 X1 Y1 Z1 E1 F1800"}) {
    const Event event = session.read(line);
    EXPECT_EQ(event.kind, EventKind::passive) << line;
    EXPECT_THAT(event.segments, IsEmpty()) << line;
    EXPECT_THAT(event.warnings, IsEmpty()) << line;
  }
  EXPECT_DOUBLE_EQ(session.state().feed_mm_s, 30.0);
}

TEST(Moves, OfFilamentAloneStayInPlace) {
  Session session;
  session.read("G1 X1 Y1 Z1");
  const Segment segment = session.move("G1 X1.0000000001 E-2 F1800");
  EXPECT_THAT(segment.end_mm, ElementsAre(1, 1, 1, -2)) << "below a nanometre nothing moves";
  EXPECT_EQ(segment.length_mm(), 0.0);
}

TEST(Moves, WithASpeedThatIsNotPositiveAreRefusedByKlipper) {
  for (const char* line : {"G1 X5 F0", "G1 X6 F-100", "G1 F0"}) {
    Session session;
    const Event event = session.read(line);
    EXPECT_EQ(event.kind, EventKind::barrier) << line;
    EXPECT_TRUE(event.segments.empty()) << line;
    EXPECT_THAT(event.warnings, SizeIs(1)) << line;
    EXPECT_DOUBLE_EQ(session.move("G1 X7").feed_mm_s, 25.0);
  }
}

TEST(Moves, OfSeveralCommandsOrWithAWordTwiceAreRemarkedOn) {
  for (const char* line : {"G1 X5 X6", "G1 X5 G1 Y6", "G1 X6 M106 S255"}) {
    Session session;
    const Event event = session.read(line);
    EXPECT_EQ(event.kind, EventKind::move) << line;
    EXPECT_THAT(event.warnings, SizeIs(1)) << line;
  }
  Session session;
  EXPECT_EQ(session.move("G1 X5 X6").end_mm[X], 6.0) << "the last one counts";
}

TEST(Moves, ThatCannotBeReadStopAndLoseThePosition) {
  for (const char* line :
       {"G1 X", "G1 X1 F", "G1 E Y2", "G1 X1..2", "G1 X9999999999999", "G2 X I1", "G1 X1*5"}) {
    Session session;
    session.read("G1 X1 Y1 Z1");
    const Event event = session.read(line);
    EXPECT_EQ(event.kind, EventKind::barrier) << line;
    EXPECT_TRUE(event.position_lost) << line;
    EXPECT_THAT(event.segments, IsEmpty()) << line;
    ASSERT_THAT(event.warnings, SizeIs(1)) << line;
    EXPECT_THAT(event.warnings[0], HasSubstr("passed through unchanged; check the line")) << line;
    EXPECT_THAT(session.state().position_mm, ElementsAre(1, 1, 1, 0)) << line;
    EXPECT_FALSE(session.move("G1 X3").start_known) << line;
  }
}

TEST(Moves, IgnoreWordsOfOtherAxes) {
  Session session;
  EXPECT_THAT(session.move("G1 X1 H5 D S2 P").end_mm, ElementsAre(1, 0, 0, 0));
}

// Expects every piece to start on the circle where the previous one ended, and the last one to end
// at the target.
void expect_on_circle(const Event& event, double centre_x, double centre_y, double radius) {
  for (std::size_t i = 0; i < event.segments.size(); ++i) {
    const Position& end = event.segments[i].end_mm;
    EXPECT_NEAR(std::hypot(end[X] - centre_x, end[Y] - centre_y), radius, 1e-9);
    if (i > 0) {
      EXPECT_EQ(event.segments[i].start_mm, event.segments[i - 1].end_mm);
    }
  }
}

TEST(Arcs, RunOnTheirCircleToTheExactTarget) {
  Session session;
  session.read("G1 X30 Y20 Z1 F600");
  const Event event = session.read("G3 X20 Y30 I-10 J0 E1.5 F1200");
  EXPECT_EQ(event.kind, EventKind::move);
  EXPECT_EQ(event.segments.size(), 15U) << "a quarter of a circle: 15.7 mm";
  expect_on_circle(event, 20, 20, 10);
  EXPECT_THAT(event.segments.back().end_mm, ElementsAre(20, 30, 1, 1.5));
  const Position middle = event.segments[6].end_mm;
  EXPECT_GT(middle[X], 20.0);
  EXPECT_GT(middle[Y], 20.0) << "anticlockwise goes through the first quadrant";
  for (const Segment& segment : event.segments) {
    EXPECT_NEAR(segment.delta(E), 0.1, 1e-12);
    EXPECT_DOUBLE_EQ(segment.feed_mm_s, 20.0);
    EXPECT_TRUE(segment.start_known);
  }
}

TEST(Arcs, ClockwiseTakeTheOtherWay) {
  Session session;
  const Event event = session.read("G1 X30 Y20 Z1\nG2 X20 Y30 I-10 J0");
  EXPECT_EQ(event.segments.size(), 47U) << "three quarters of a circle: 47.1 mm";
  expect_on_circle(event, 20, 20, 10);
  EXPECT_LT(event.segments[10].end_mm[Y], 20.0);
}

TEST(Arcs, CloseFullCirclesInBothDirections) {
  for (const char* line : {"G2 I5", "G3 X10 Y10 I5", "G2 X10 Y10 I5 J0", "G3 I5 E0"}) {
    Session session;
    const Event event = session.read(std::string("G1 X10 Y10 Z1\n") + line);
    EXPECT_EQ(event.segments.size(), 31U) << line;
    expect_on_circle(event, 15, 10, 5);
    EXPECT_THAT(event.segments.back().end_mm, ElementsAre(10, 10, 1, 0));
    const bool clockwise = line[1] == '2';
    EXPECT_EQ(event.segments[5].end_mm[Y] > 10.0, clockwise) << line;
  }
}

// A reading far from the machine's position makes start and end differ in their last digits.
TEST(Arcs, CloseFullCirclesWhateverTheRoundOff) {
  std::size_t apart = 0;
  for (int i = 0; i < 200; ++i) {
    for (const char* line : {"G2 X-200.246 Y10.1 I7.3 J-3.1", "G3 X-200.246 Y10.1 I7.3 J-3.1",
                             "G3 I-.7", "G18\nG3 X-200.246 Z1 I1.7 K.3 Y9", "G19\nG2 J.1 K.9"}) {
      Session session;
      session.read("G1 X" + std::to_string(3.1 + 0.037 * i) + " Y10.1 Z1\nG92 X-200.246");
      const Position start = session.state().position_mm;
      double length = 0.0;
      for (const Segment& segment : session.read(line).segments) {
        length += segment.length_mm();
      }
      EXPECT_GT(length, 3.9 * 0.7) << line << ", " << i;
      EXPECT_NEAR(session.state().position_mm[X], start[X], 1e-9);
      apart += session.state().position_mm[X] == start[X] ? 0 : 1;
    }
  }
  EXPECT_GT(apart, 50U) << "too few of the circles are put to the test";
}

TEST(Arcs, RiseEvenlyAsHelices) {
  Session session;
  const Event event = session.read("M83\nG1 X10 Y10 Z1\nG3 X10 Y10 Z32.4 I5 E6.2");
  ASSERT_EQ(event.segments.size(), 44U) << "hypot(31.4, 31.4) = 44.4 mm";
  expect_on_circle(event, 15, 10, 5);
  for (const Segment& segment : event.segments) {
    EXPECT_NEAR(segment.delta(Z), 31.4 / 44, 1e-12);
    EXPECT_NEAR(segment.delta(E), 6.2 / 44, 1e-12);
  }
  EXPECT_DOUBLE_EQ(session.state().position_mm[Z], 32.4);
}

TEST(Arcs, LieInTheChosenPlane) {
  Session session;
  Event event = session.read("G1 X10 Y10 Z10\nG18\nG2 X20 Z10 I5 K0");
  ASSERT_EQ(event.segments.size(), 15U);
  for (const Segment& segment : event.segments) {
    EXPECT_NEAR(std::hypot(segment.end_mm[X] - 15, segment.end_mm[Z] - 10), 5.0, 1e-9);
    EXPECT_EQ(segment.end_mm[Y], 10.0);
  }
  event = session.read("G19\nG3 Y20 Z10 J5 I99");
  ASSERT_EQ(event.segments.size(), 15U);
  for (const Segment& segment : event.segments) {
    EXPECT_NEAR(std::hypot(segment.end_mm[Y] - 15, segment.end_mm[Z] - 10), 5.0, 1e-9);
    EXPECT_EQ(segment.end_mm[X], 20.0);
  }
  EXPECT_EQ(session.read("G17\nG1 X0 Y0\nG2 X10 I5").segments.size(), 15U);
}

TEST(Arcs, GivenByRadiusAreRefusedByKlipper) {
  Session session;
  const Event event = session.read("G1 X10 Y0 Z1\nG3 X0 Y10 R10");
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_THAT(event.warnings, SizeIs(1));
}

TEST(Arcs, ThatEndOffTheirCircleAreRemarkedOn) {
  Session session;
  const Event event = session.read("G1 X10 Y0 Z1\nG3 X0 Y10.2 I-10");
  EXPECT_THAT(event.segments.back().end_mm, ElementsAre(0, 10.2, 1, 0));
  EXPECT_THAT(event.warnings, SizeIs(1));
  EXPECT_THAT(session.read("G1 X10 Y0\nG3 X0 Y10.002 I-10").warnings, SizeIs(0));
}

TEST(Arcs, FollowTheResolution) {
  Session session(InterpreterOptions{.arc_resolution_mm = 0.1});
  EXPECT_EQ(session.read("G1 X10 Y10 Z1\nG2 I5").segments.size(), 314U);
  Session coarse(InterpreterOptions{.arc_resolution_mm = 100.0});
  EXPECT_EQ(coarse.read("G1 X10 Y10 Z1\nG2 X20 I5").segments.size(), 1U);
}

TEST(Arcs, WithoutACentreAreNotUnderstood) {
  for (const char* line : {"G2 X5 Y5", "G3 X5 I0 J0", "G2 R5", "G2 X5 R0", "G2 X5 R", "G2 X5 I J2",
                           "G18\nG2 X5 J5", "G2 X5 I999999999"}) {
    Session session;
    const Event event = session.read(std::string("G1 X1 Y1 Z1\n") + line);
    EXPECT_EQ(event.kind, EventKind::barrier) << line;
    EXPECT_TRUE(event.position_lost) << line;
    EXPECT_THAT(event.warnings, SizeIs(1)) << line;
    EXPECT_THAT(session.state().position_mm, ElementsAre(1, 1, 1, 0)) << line;
  }
}

TEST(Arcs, InRelativeModeAreRefusedAsByKlipper) {
  Session session;
  const Event event = session.read("G1 X1 Y1 Z1\nG91\nG2 X5 I2.5");
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_TRUE(event.position_lost);
  EXPECT_THAT(event.warnings, SizeIs(1));
}

TEST(Arcs, LieInAPlaneOfUnknownHeightOnlyWhereTheyDoNotLeaveIt) {
  const auto start_known = [](const char* lines) {
    Session session;
    const Event event = session.read(lines);
    EXPECT_FALSE(event.segments.empty()) << lines;
    return !event.segments.empty() && event.segments.back().start_known;
  };
  EXPECT_TRUE(start_known("G28\nG1 X0 Y0\nG2 X10 Y0 I5"));
  EXPECT_FALSE(start_known("G28\nG1 X0 Y0\nG2 X10 Y0 Z1 I5"));
  EXPECT_FALSE(start_known("G28\nG1 X0 Y0\nG18\nG2 X10 I5")) << "in X and Z";
  EXPECT_TRUE(start_known("G28\nG1 X0 Y0 Z0\nG18\nG2 X10 I5"));
}

TEST(Arcs, FromAnUnknownPlaceSayItOnEveryPiece) {
  Session session;
  const Event event = session.read("G28\nG2 X10 Y0 I5");
  ASSERT_EQ(event.segments.size(), 15U);
  for (const Segment& segment : event.segments) {
    EXPECT_FALSE(segment.start_known);
  }
  EXPECT_THAT(session.state().known, ElementsAre(true, true, false, true));
}

}  // namespace
}  // namespace unflex::gcode
