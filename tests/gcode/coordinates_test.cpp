// Modes and coordinates: G20 G21, G28, G90 G91, G92, M82 M83, M220 M221, offsets, saved states.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(Coordinates, StartAbsoluteAtAnUnknownPlace) {
  const Session session;
  EXPECT_TRUE(session.state().absolute_xyz);
  EXPECT_TRUE(session.state().absolute_e);
  EXPECT_EQ(session.state().feed_mm_s, 25.0);
  EXPECT_THAT(session.state().known, ElementsAre(false, false, false, true));
}

TEST(Coordinates, ChangeModesWithoutStopping) {
  Session session;
  for (const char* line : {"G17", "G18", "G19", "G21", "G90", "G91", "M82", "M83", "G92 E0"}) {
    const Event event = session.read(line);
    EXPECT_EQ(event.kind, EventKind::passive) << line;
    EXPECT_THAT(event.warnings, IsEmpty()) << line;
  }
  EXPECT_EQ(session.state().plane, 19);
  EXPECT_FALSE(session.state().absolute_xyz);
  EXPECT_FALSE(session.state().absolute_e);
}

TEST(Coordinates, RelativeMovesAddUp) {
  Session session;
  const Segment segment = session.move("G90\nG1 X10 Y20 Z3 E5\nG91\nG1 X-1 E2\nG1 Y2 Z.5 E1");
  EXPECT_THAT(segment.start_mm, ElementsAre(9, 20, 3, 7));
  EXPECT_THAT(segment.end_mm, ElementsAre(9, 22, 3.5, 8));
}

TEST(Coordinates, G91MakesExtrusionRelativeWhateverM82Says) {
  Session session;
  EXPECT_EQ(session.move("M82\nG91\nG1 E2\nG1 E3").end_mm[E], 5.0);
  EXPECT_EQ(session.move("G90\nG1 E6").end_mm[E], 6.0);
  EXPECT_EQ(session.move("M83\nG1 E6").end_mm[E], 12.0);
}

TEST(Coordinates, InchesScaleEveryLength) {
  Session session;
  const Segment segment = session.move("G20\nG1 X1 Y2 Z.5 E.1 F60");
  EXPECT_THAT(segment.end_mm, ElementsAre(25.4, 50.8, 12.7, 0.1 * 25.4));
  EXPECT_DOUBLE_EQ(segment.feed_mm_s, 25.4);
  session.read("G92 E1");
  EXPECT_DOUBLE_EQ(session.move("G1 E2").delta(E), 25.4);
  EXPECT_DOUBLE_EQ(session.move("G21\nG1 X26.4").delta(X), 1.0);
  const Event arc = session.read("G20\nG1 X2 Y0\nG2 X0 Y0 I-1");
  EXPECT_EQ(arc.segments.size(), 79U) << "half a circle of 25.4 mm radius in pieces of a mm";
}

TEST(Coordinates, G92ShiftsTheZeroOfTheNamedAxes) {
  Session session;
  Event event = session.read("G1 X10 Y20 Z1 E5\nG92 X0 E1");
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_FALSE(event.position_lost);
  EXPECT_THAT(session.move("G1 X5 Y5 E2").end_mm, ElementsAre(15, 5, 1, 6));
  event = session.read("G92");
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_THAT(session.state().base_mm, ElementsAre(15, 5, 1, 6));
  EXPECT_THAT(session.move("G1 X1 Y1 Z1 E1").end_mm, ElementsAre(16, 6, 2, 7));
}

TEST(Coordinates, G92OfExtrusionAloneDoesNotStop) {
  Session session;
  EXPECT_EQ(session.read("G1 E5\nG92 E0.0").kind, EventKind::passive);
  EXPECT_EQ(session.move("G1 E1").end_mm[E], 6.0);
}

TEST(Coordinates, G92WithoutANumberIsNotUnderstood) {
  Session session;
  const Event event = session.read("G92 X");
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_TRUE(event.position_lost);
  EXPECT_THAT(event.warnings, SizeIs(1));
}

TEST(Coordinates, BecomeKnownAxisByAxis) {
  Session session;
  EXPECT_FALSE(session.move("G1 X1 Y1").start_known);
  EXPECT_THAT(session.state().known, ElementsAre(true, true, false, true));
  EXPECT_TRUE(session.move("G1 X2").start_known) << "in its plane, wherever that is";
  EXPECT_TRUE(session.move("G91\nG1 Y2 E1").start_known);
  EXPECT_FALSE(session.move("G1 X1 Z0.1").start_known) << "from a height that nobody knows";
  EXPECT_FALSE(session.move("G90\nG1 X3 Z1").start_known);
  EXPECT_TRUE(session.move("G1 X2 Z2").start_known);
  EXPECT_TRUE(session.move("T0\nG1 X1 Y1\nG1 X2").start_known);
  EXPECT_FALSE(session.move("T0\nG1 X1 Z1\nG1 X2").start_known) << "Y is not known";
  EXPECT_FALSE(session.move("T0\nG1 Y1 Z1\nG1 Y2").start_known) << "X is not known";
  EXPECT_FALSE(session.move("T0\nG1 X2 Y2\nG1 Z3").start_known);
  EXPECT_TRUE(session.move("G1 X3").start_known);
  EXPECT_TRUE(session.move("G91\nG1 X3").start_known);
}

TEST(Coordinates, StayUnknownThroughRelativeMoves) {
  Session session;
  EXPECT_FALSE(session.move("G91\nG1 X1 Y1 Z1\nG1 X1 Y1 Z1").start_known);
  EXPECT_THAT(session.state().known, ElementsAre(false, false, false, true));
}

// Kiri:Moto's prints begin so. The place on the bed does not matter.
TEST(Coordinates, AreToldFromAZeroThatIsSetAtAnUnknownPlace) {
  Session session;
  EXPECT_EQ(session.read("G28\nG92 X0 Y0 Z0").kind, EventKind::barrier);
  EXPECT_THAT(session.state().known, ElementsAre(true, true, true, true));
  const Segment segment = session.move("G1 X1 Y1 Z1");
  EXPECT_TRUE(segment.start_known);
  EXPECT_EQ(segment.delta(X), 1.0);
  EXPECT_FALSE(session.move("PRINT_START\nG1 X2 Y2").start_known);
  EXPECT_TRUE(session.move("G1 X3").start_known);
  EXPECT_FALSE(session.move("G28\nG1 X4 Y4 Z1").start_known);
  EXPECT_TRUE(session.move("G92 X0\nG1 X3").start_known);
}

TEST(Coordinates, AreNotToldFromAZeroElsewhere) {
  Session session;
  session.read("G28\nG1 X1 Y1 Z1\nSAVE_GCODE_STATE\nG28\nG92 X0 Y0\nG1 Z1\nG1 X1 Y1");
  EXPECT_THAT(session.state().known, ElementsAre(true, true, true, true));
  session.read("RESTORE_GCODE_STATE");
  EXPECT_THAT(session.state().known, ElementsAre(false, false, true, true));
  session.read("G1 X5 Y5\nSAVE_GCODE_STATE\nG1 X6\nRESTORE_GCODE_STATE");
  EXPECT_THAT(session.state().known, ElementsAre(true, true, true, true));
}

TEST(Coordinates, MoveFromAnUnknownPlaceToTheSameReadingStops) {
  Session session;
  Event event = session.read("G28\nG1 X0 Y0 F3000");
  EXPECT_EQ(event.kind, EventKind::barrier) << "the machine moves, though the numbers do not";
  EXPECT_FALSE(event.position_lost);
  EXPECT_THAT(session.state().known, ElementsAre(true, true, false, true));
  event = session.read("G1 X0 Y0");
  EXPECT_EQ(event.kind, EventKind::passive);
}

// Homing one axis moves others: Z is probed at another place, and X and Y are homed with Z lifted.
TEST(Coordinates, HomingAnyAxisForgetsAllAndKeepsTheirReadings) {
  Session session;
  Event event = session.read("G1 X1 Y2 Z3\nG28 X0");
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_TRUE(event.position_lost);
  EXPECT_THAT(session.state().known, ElementsAre(false, false, false, true));
  EXPECT_THAT(session.state().position_mm, ElementsAre(1, 2, 3, 0));
  session.read("G1 X1 Y2 Z3\nG28 Z");
  EXPECT_THAT(session.state().known, ElementsAre(false, false, false, true));
  for (const char* all : {"G28", "G28 W", "G28 O"}) {
    session.read("G1 X1 Y2 Z3");
    session.read(all);
    EXPECT_THAT(session.state().known, ElementsAre(false, false, false, true)) << all;
  }
}

TEST(Coordinates, HomingTakesG92OffTheAxis) {
  Session session;
  session.read("G1 X1 Y2 Z3\nG92 X0 Y0\nG28 X");
  EXPECT_THAT(session.state().base_mm, ElementsAre(0, 2, 0, 0));
}

TEST(Coordinates, AMacroLosesThePositionAndTheAbsoluteExtrusion) {
  Session session;
  session.read("G1 X1 Y1 Z1 E1");
  const Event event = session.read("PRINT_START BED=60");
  EXPECT_TRUE(event.position_lost);
  EXPECT_THAT(session.state().known, ElementsAre(false, false, false, false));
  session.read("G1 X2 Y2 Z2");
  EXPECT_TRUE(session.move("G1 X3").start_known);
  EXPECT_FALSE(session.move("G1 X4 E2").start_known) << "the macro may have moved the filament";
  EXPECT_TRUE(session.move("G1 X5 E3").start_known);
  session.read("T1\nG92 E0\nG1 X2 Y2 Z2");
  EXPECT_TRUE(session.move("G1 X3 E1").start_known);
  session.read("T1\nM83\nG1 X3 Y2 Z2");
  EXPECT_TRUE(session.move("G1 X4 E1").start_known);
}

TEST(Coordinates, SpeedFactorScalesMovesAndNotTheModalSpeed) {
  Session session;
  EXPECT_DOUBLE_EQ(session.move("G1 X1 F600").feed_mm_s, 10.0);
  EXPECT_EQ(session.read("M220 S50").kind, EventKind::passive);
  EXPECT_DOUBLE_EQ(session.move("G1 X2").feed_mm_s, 5.0);
  EXPECT_DOUBLE_EQ(session.move("G1 X3 F1200").feed_mm_s, 10.0);
  EXPECT_DOUBLE_EQ(session.state().feed_mm_s, 20.0);
  EXPECT_DOUBLE_EQ(session.move("M220\nG1 X4").feed_mm_s, 20.0);
  for (const char* wrong : {"M220 S0", "M220 S-5", "M220 S"}) {
    const Event event = session.read(wrong);
    EXPECT_EQ(event.kind, EventKind::passive);
    EXPECT_THAT(event.warnings, SizeIs(1)) << wrong;
    EXPECT_EQ(session.state().speed_factor, 1.0);
  }
}

TEST(Coordinates, FlowFactorScalesExtrusionAndKeepsItsReading) {
  Session session;
  session.read("G1 X1 Y1 Z1 E10\nM221 S95");
  EXPECT_EQ(session.state().position_mm[E], 10.0);
  EXPECT_NEAR(session.move("G1 E12").delta(E), 1.9, 1e-12);
  EXPECT_EQ(session.read("M221 S100\nG1 X2 E12").segments.size(), 1U);
  EXPECT_NEAR(session.state().position_mm[E], 11.9, 1e-12) << "the same reading, no filament";
  EXPECT_NEAR(session.move("M221 S50\nM83\nG1 E2").delta(E), 1.0, 1e-12);
  EXPECT_NEAR(session.move("M82\nG92 E100\nG1 E101").delta(E), 0.5, 1e-12);
  for (const char* wrong : {"M221 S0", "M221 Sx"}) {
    EXPECT_THAT(session.read(wrong).warnings, SizeIs(1)) << wrong;
    EXPECT_EQ(session.state().flow_factor, 0.5);
  }
}

TEST(Coordinates, OffsetsShiftTheZeroAndStopNothing) {
  Session session;
  session.read("G1 X1 Y1 Z1");
  Event event = session.read("SET_GCODE_OFFSET Z=0.2 x=-1");
  EXPECT_EQ(event.kind, EventKind::border);
  EXPECT_FALSE(event.position_lost);
  EXPECT_THAT(session.state().position_mm, ElementsAre(1, 1, 1, 0));
  EXPECT_THAT(session.move("G1 X1 Z1").end_mm, ElementsAre(0, 1, 1.2, 0));
  session.read("SET_GCODE_OFFSET Z_ADJUST=0.05\nSET_GCODE_OFFSET Z_ADJUST=5e-2");
  EXPECT_NEAR(session.state().base_mm[Z], 0.3, 1e-12);
  EXPECT_NEAR(session.state().offset_mm[Z], 0.3, 1e-12);
  session.read("G92 Z9\nG28 Z");
  EXPECT_NEAR(session.state().base_mm[Z], 0.3, 1e-12) << "homing restores the offset";
  session.read("SET_GCODE_OFFSET Z=0");
  EXPECT_NEAR(session.state().base_mm[Z], 0.0, 1e-12);
}

TEST(Coordinates, OffsetsThatMoveLoseThePosition) {
  Session session;
  Event event = session.read("G1 X1 Y1 Z1\nSET_GCODE_OFFSET Z=0.2 MOVE=1");
  EXPECT_TRUE(event.position_lost);
  EXPECT_DOUBLE_EQ(session.state().position_mm[Z], 1.2);
  event = session.read("SET_GCODE_OFFSET Z=0.2 MOVE=0");
  EXPECT_FALSE(event.position_lost);
  event = session.read("SET_GCODE_OFFSET Z=up");
  EXPECT_TRUE(event.position_lost);
  EXPECT_THAT(event.warnings, SizeIs(1));
}

TEST(Coordinates, SavedStatesComeBack) {
  Session session;
  session.read("G1 X1 Y1 Z1 E4 F600\nM83\nG92 X0");
  EXPECT_EQ(session.read("SAVE_GCODE_STATE NAME=a").kind, EventKind::border);
  session.read("G91\nM82\nM221 S50\nM220 S50\nG1 X5 E2 F1200\nG92 X3");
  Event event = session.read("RESTORE_GCODE_STATE NAME=a");
  EXPECT_EQ(event.kind, EventKind::border);
  EXPECT_FALSE(event.position_lost);
  EXPECT_TRUE(session.state().absolute_xyz);
  EXPECT_FALSE(session.state().absolute_e);
  EXPECT_DOUBLE_EQ(session.state().feed_mm_s, 10.0);
  EXPECT_DOUBLE_EQ(session.state().speed_factor, 1.0);
  EXPECT_DOUBLE_EQ(session.state().flow_factor, 1.0);
  EXPECT_THAT(session.state().base_mm, ElementsAre(1, 0, 0, 1));
  EXPECT_THAT(session.move("M82\nG1 X7 E5").end_mm, ElementsAre(8, 1, 1, 6));
  session.read("G28\nG92 X0\nRESTORE_GCODE_STATE NAME=a\nG1 X1 Y1 Z1");
  EXPECT_TRUE(session.move("G1 X2").start_known) << "the zero is the saved one";
  event = session.read("RESTORE_GCODE_STATE NAME=a MOVE=1");
  EXPECT_TRUE(event.position_lost);
  event = session.read("RESTORE_GCODE_STATE");
  EXPECT_TRUE(event.position_lost);
  EXPECT_THAT(event.warnings, SizeIs(1));
}

}  // namespace
}  // namespace unflex::gcode
