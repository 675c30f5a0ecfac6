#include "unflex/gcode/compensable.hpp"

#include <gtest/gtest.h>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

Segment by(double dx, double dy, double dz, double de) {
  return {{5, 5, 5, 5}, {5 + dx, 5 + dy, 5 + dz, 5 + de}, 10.0, 1, true};
}

TEST(Compensable, AreMovesInThePlane) {
  EXPECT_TRUE(compensable(by(1, 0, 0, 0), Firmware::klipper)) << "travel";
  EXPECT_TRUE(compensable(by(0, -1, 0, 0.1), Firmware::klipper)) << "extrusion";
  EXPECT_TRUE(compensable(by(3, 4, 0.099, 0.1), Firmware::klipper)) << "a spiral vase";
  EXPECT_TRUE(compensable(by(1, 0, 0, -1e-12), Firmware::klipper))
      << "round-off of the running filament sum";
  EXPECT_EQ(kept_reason(by(1, 0, 0, 0), Firmware::klipper), "");
}

// kinematics/extruder.py, check_move: Klipper ends the print at such a move, unless it is a dab.
TEST(Compensable, AreNotThoseThatKlipperRefuses) {
  InterpreterOptions options = default_options(Firmware::klipper);
  options.max_extrude_ratio = 0.25;
  options.max_extrude_dab_mm = 0.1;
  Session session(options);
  session.read("G28\nM83\nG1 X10 Y10 Z1 F6000\n");
  const Event event = session.read("G1 X11 E8");
  ASSERT_EQ(event.segments.size(), 1U);
  EXPECT_EQ(kept_reason(event.segments[0], Firmware::klipper), "too much filament");
  ASSERT_EQ(event.warnings.size(), 1U);
  EXPECT_EQ(event.warnings[0],
            "8 mm of filament in 1 mm of path: Klipper ends the print at such a move "
            "(max_extrude_cross_section); passed through unchanged, check the line");
  EXPECT_TRUE(compensable(session.move("G1 X21 E2.5"), Firmware::klipper));
  EXPECT_TRUE(compensable(session.move("G1 X21.1 E0.09"), Firmware::klipper)) << "a dab";
  EXPECT_TRUE(session.read("G1 E8").warnings.empty()) << "filament alone";
}

TEST(Compensable, AreNotThoseWithMoreFilamentThanANozzleTakes) {
  InterpreterOptions options = default_options(Firmware::marlin);
  options.max_extrude_ratio = 1.25;
  options.max_extrude_dab_mm = 0.5;
  Session session(options);
  session.read("G28\nM83\nG1 X10 Y10 Z1 F6000\n");
  const Event event = session.read("G1 X11 E8");
  EXPECT_EQ(kept_reason(event.segments[0], Firmware::marlin), "too much filament");
  ASSERT_EQ(event.warnings.size(), 1U);
  EXPECT_EQ(event.warnings[0],
            "8 mm of filament in 1 mm of path: no nozzle takes so much; passed through unchanged, "
            "check the line");
  EXPECT_EQ(kept_reason(session.read("G1 X12 E-8").segments[0], Firmware::marlin),
            "too much filament");
  EXPECT_TRUE(compensable(session.move("G1 X21 E10"), Firmware::marlin));
}

TEST(Compensable, AreNotTheOthersForAReason) {
  EXPECT_EQ(kept_reason(by(0, 0, 0, 1), Firmware::klipper), "extrude only");
  EXPECT_EQ(kept_reason(by(0, 0, 1, 0), Firmware::klipper), "Z move");
  EXPECT_EQ(kept_reason(by(3, 4, 0.101, 0), Firmware::klipper), "Z move");
  Segment unknown = by(1, 0, 0, 0);
  unknown.start_known = false;
  EXPECT_EQ(kept_reason(unknown, Firmware::klipper), "start unknown");
  EXPECT_FALSE(compensable(unknown, Firmware::klipper));
}

TEST(Compensable, AreWipesThatPullFilamentBackWhereTheirLimitsCanBeRaised) {
  EXPECT_EQ(kept_reason(by(1, 0, 0, -0.5), Firmware::klipper), "retracting move");
  EXPECT_EQ(kept_reason(by(1, 0, 0, -0.5), Firmware::marlin), "");
  EXPECT_EQ(kept_reason(by(1, 0, 0, -0.5), Firmware::rrf), "");
  EXPECT_EQ(kept_reason(by(0, 0, 0, -0.5), Firmware::rrf), "extrude only");
}

TEST(Compensable, AreLinesAsAWhole) {
  Session session;
  session.read("G1 X1 Y1 Z1");
  EXPECT_TRUE(compensable(session.read("G1 X5"), Firmware::klipper));
  EXPECT_TRUE(compensable(session.read("G2 X15 I5 E1"), Firmware::klipper));
  EXPECT_FALSE(compensable(session.read("G2 X25 Z9 I5 E1"), Firmware::klipper));
  EXPECT_FALSE(compensable(session.read("M105"), Firmware::klipper));
  EXPECT_FALSE(compensable(session.read("G1 X25"), Firmware::klipper));
}

TEST(NamesPosition, IsTrueForMovesByTheirWords) {
  for (const char* const line :
       {"G1 X5", "g0 y2 f100", "N3 G1 E.5", "G3 X1 I5", "  G1 Z0.2 ; up"}) {
    EXPECT_TRUE(names_position(line)) << line;
  }
  for (const char* const line :
       {"", "; G1 X5", "G1 F1200", "G92 X5", "G28 X0", "M204 S500", "G4 P5", "SET_PIN PIN=x"}) {
    EXPECT_FALSE(names_position(line)) << line;
  }
}

}  // namespace
}  // namespace unflex::gcode
