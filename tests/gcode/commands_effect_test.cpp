// Which commands stop the machine, and which lose its position.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

using ::testing::Each;
using ::testing::IsEmpty;
using ::testing::SizeIs;

class CommandEffect : public ::testing::TestWithParam<const char*> {
 protected:
  CommandEffect() { session_.read("G1 X1 Y1 Z1"); }
  Session session_;
};

class Passive : public CommandEffect {};
class Stopping : public CommandEffect {};
class Losing : public CommandEffect {};
class NotUnderstood : public CommandEffect {};

TEST_P(Passive, LetsTheMotionGoOn) {
  const Event event = session_.read(GetParam());
  EXPECT_EQ(event.kind, EventKind::passive);
  EXPECT_FALSE(event.position_lost);
  EXPECT_THAT(event.segments, IsEmpty());
  EXPECT_THAT(event.warnings, IsEmpty());
  EXPECT_TRUE(session_.move("G1 X2").start_known);
}

INSTANTIATE_TEST_SUITE_P(
    Commands, Passive,
    ::testing::Values(
        "", "; comment", "(comment)", "N5", "M73 P10 R5", "M82", "M104 S210", "M105", "M106 S255",
        "M107", "M110 N0", "M115 U3.9.0", "M117 G28 now", "M118 A1 text", "M140 S60", "M141 S40",
        "M201 X1000 Y1000", "M203 X200", "M205 X8 Y8", "M204 P500", "M566 X300 P1", "M569 P0 S1",
        "M593 F0", "M862.3 P \"MK3S\"", "M862.1 P0.4", "M906 X800", "M907 E430", "M75", "M76",
        "M77", "M155 S2", "M250 C50", "M302 S0", "M355 S1", "SET_FAN_SPEED FAN=a SPEED=.5",
        "SET_PIN PIN=a VALUE=1", "SET_LED LED=a RED=1",
        "SET_HEATER_TEMPERATURE HEATER=extruder TARGET=210", "RESPOND MSG=\"G28\"",
        "EXCLUDE_OBJECT_DEFINE NAME=a", "SET_DISPLAY_TEXT MSG=hi",
        "set_filament_sensor SENSOR=a ENABLE=0", "SET_IDLE_TIMEOUT TIMEOUT=60",
        "SET_GCODE_VARIABLE MACRO=a VARIABLE=b VALUE=1", "TURN_OFF_HEATERS",
        "UNFLEX_CHECKPOINT RUN=1 SHAPER_FREQ_X=45", "SET_SERVO SERVO=a ANGLE=1", "SET_RETRACTION",
        "M70 P5", "M73.2 R1.0", "M101", "M103", "M142 S36", "M201.2 K1.0", "M202 X1000 Y1000",
        "M205.1 X5", "M330 SYSLOG", "M567 P0 E1.0:0.0", "M569.1 P0", "M620.1 E F523 T240",
        "M620 S0A", "M621 S0A", "M622.1 S1", "M622 J1", "M623", "M624 AQAAAAAAAAA=", "M625",
        "M862.6 P\"Input shaper\"", "M900.1 K1", "M914 X50", "M960 S5 P1", "M971 S11 C11 O0",
        "M975 S1", "M981 S1 P20000", "M991 S0 P3", "M1002 gcode_claim_action : 0",
        "M1002 judge_flag timelapse_record_flag", "M1006 S1", "G392 S0"));

TEST_P(Stopping, FinishesAllMotionAndKeepsThePosition) {
  const Event event = session_.read(GetParam());
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_FALSE(event.position_lost);
  EXPECT_EQ(event.dwell_s, 0.0);
  EXPECT_THAT(event.warnings, IsEmpty());
  EXPECT_TRUE(session_.move("G1 X2").start_known);
}

INSTANTIATE_TEST_SUITE_P(Commands, Stopping,
                         ::testing::Values("M900 K0.05", "M572 D0 S0.05",
                                           "SET_PRINT_STATS_INFO CURRENT_LAYER=3", "G4", "M400",
                                           "M109 S210", "M190 S60", "M191 S40", "M116", "M17",
                                           "M119", "M300 S440 P50", "M150 R255", "M280 P0 S90",
                                           "M412 S1", "M420 S1", "G92 X0", "G92", "G10 P0 S210",
                                           "SET_INPUT_SHAPER TYPE=mzv",
                                           "SET_PRESSURE_ADVANCE ADVANCE=0.04 SMOOTH_TIME=.04",
                                           "TEMPERATURE_WAIT SENSOR=a MINIMUM=50",
                                           "SET_TMC_CURRENT STEPPER=stepper_x CURRENT=1"));

TEST_P(Losing, LeavesTheMachineAnywhere) {
  const Event event = session_.read(GetParam());
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_TRUE(event.position_lost);
  // A line of motion names the words that are to blame.
  const bool blames_words = std::regex_search(GetParam(), std::regex("^G[0-3] .*[ABCDPSUVW][0-9]"));
  EXPECT_EQ(event.warnings.size(), blames_words ? 1U : 0U);
  EXPECT_FALSE(session_.move("G1 X2").start_known);
}

INSTANTIATE_TEST_SUITE_P(
    Commands, Losing,
    ::testing::Values("G1 X5 A2", "G1 A9 F600", "RESPOND TYPE=command MSG=\"action:pause\"", "G28",
                      "G28 W", "G29", "G80", "G32", "G30 X1 Y1", "G34", "G1009", "G1.5 X3",
                      "G5 X1 Y1 I1 J1 P1 Q1", "T0", "T12", "Tx", "M0", "M1", "M25", "M226", "M600",
                      "M601", "M18", "M84", "M84 S5", "M42 P1 S1", "M112", "M999", "M109.1", "X5",
                      "M970.3 Q1 A7 B30 C80", "M976 S1 P1", "M240", "M1234", "M600.1", "G29.2 S0",
                      "PRINT_START BED=60", "print_end", "PAUSE", "MY_LAYER_MACRO A=1",
                      "BED_MESH_PROFILE LOAD=default", "SET_GCODE_OFFSET Z=1 MOVE=1"));

// Bambu's firmware may skip these lines. Klipper does not know M622 and carries them out.
TEST(LinesUnderBambusCondition, AreCarriedOut) {
  Session session;
  session.read("G1 X1 Y1 Z1\nM1002 judge_flag timelapse_record_flag\nM622 J1\nG1 X5\nG91\nM623");
  EXPECT_FALSE(session.state().absolute_xyz);
  const Segment next = session.move("G1 X2");
  EXPECT_TRUE(next.start_known);
  EXPECT_EQ(next.end_mm[X], 7.0);
}

TEST(ForeignLimits, MayBeSetByAMacro) {
  Session session;
  for (const char* line : {"M201 X1000", "M202 X1000", "M203 X100", "M205 X8", "M566 X300"}) {
    EXPECT_TRUE(session.read(line).may_set_limits) << line;
  }
}

TEST(ExcludeObject, MayLeaveOutWhatFollows) {
  Session session;
  session.read("G1 X1 Y1 Z1");
  EXPECT_EQ(session.read("EXCLUDE_OBJECT NAME=a").kind, EventKind::border);
  const Segment next = session.move("G1 X2");
  EXPECT_FALSE(next.start_known);
  EXPECT_TRUE(next.start_assumed);
  session.read("G1 X2 Y2");
  EXPECT_TRUE(session.move("G1 X3").start_known);
}

TEST(ExcludeObject, MakesNoUnknownPlaceKnown) {
  for (const char* lost : {"G28\nEXCLUDE_OBJECT_END", "EXCLUDE_OBJECT_END\nG28"}) {
    Session session;
    session.read("G1 X1 Y1 Z1");
    session.read(lost);
    const Segment next = session.move("G1 X2 Y2");
    EXPECT_FALSE(next.start_known) << lost;
    EXPECT_FALSE(next.start_assumed) << lost;
  }
}

TEST(UnknownCommand, IsTakenToMoveNothing) {
  for (const char* command : {"MY_MACRO A=1", "M7001"}) {
    Session session;
    session.read("G1 X1 Y1 Z1");
    EXPECT_TRUE(session.read(command).position_lost);
    const Segment next = session.move("G1 X2 Y2");
    EXPECT_FALSE(next.start_known) << command;
    EXPECT_TRUE(next.start_assumed) << command;
  }
}

// kinematics/extruder.py, _set_pressure_advance: a change from none to some changes the smoothing
// time.
TEST(PressureAdvance, OfAnotherExtruderMayStop) {
  Session session;
  EXPECT_EQ(session.read("SET_PRESSURE_ADVANCE ADVANCE=.05").kind, EventKind::barrier);
  EXPECT_EQ(session.read("SET_PRESSURE_ADVANCE ADVANCE=.04").kind, EventKind::passive);
  session.read("T1");
  EXPECT_EQ(session.read("SET_PRESSURE_ADVANCE ADVANCE=.04").kind, EventKind::barrier);
}

TEST(TuningTower, LeavesTheRestAsItIs) {
  Session session;
  EXPECT_THAT(session.read("TUNING_TOWER COMMAND=SET_VELOCITY_LIMIT PARAMETER=ACCEL").warnings,
              SizeIs(1));
  session.read("G1 X1 Y1 Z1");
  EXPECT_FALSE(session.move("G1 X2").start_known);
}

TEST_P(NotUnderstood, PassesAsABarrierWithAWarning) {
  const Event event = session_.read(GetParam());
  EXPECT_EQ(event.kind, EventKind::barrier);
  EXPECT_TRUE(event.position_lost);
  EXPECT_THAT(event.warnings, SizeIs(1));
  EXPECT_THAT(event.warnings,
              Each(::testing::EndsWith("passed through unchanged; check the line")));
  EXPECT_FALSE(session_.move("G1 X2").start_known);
}

INSTANTIATE_TEST_SUITE_P(Lines, NotUnderstood,
                         ::testing::Values("?", "Hello, world", "N5 G1 X3*0", "G1 X3 ?",
                                           "RESPOND MSG=it's", "PRINT_START BED 60", "G1 X",
                                           "G92 Xa", "G2 X5", "RESTORE_GCODE_STATE NAME=no"));

TEST(Malformed, LinesNameTheirProblem) {
  Session session;
  EXPECT_EQ(session.read("N5 G1 X3*0").warnings.at(0),
            "the checksum is 0 but should be 102: passed through unchanged; check the line");
}

}  // namespace
}  // namespace unflex::gcode
