// What is refused, since a translation of it might break the machine.
#include <gmock/gmock.h>

#include <numbers>
#include <sstream>
#include <string>
#include <variant>

#include "translating.hpp"
#include "translator.hpp"

namespace unflex::flow {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string refusal(const std::string& program, Firmware firmware = Firmware::klipper) {
  return translated(program, translating(tripteron(), firmware));
}

TEST(TranslateRefuses, MovesBeforeThePlaceIsKnown) {
  TranslatorOptions options = translating(tripteron());
  options.home_mm.reset();
  const auto at_once = [&](const std::string& program) { return translated(program, options); };
  EXPECT_EQ(at_once("G1 X10 F600\n"),
            "in.gcode:1: where the tool is has not been told since the start; let the first move "
            "behind it give X, Y and Z in absolute mode, or set kinematics.home_mm, where G28 "
            "leaves the tool");
  EXPECT_THAT(at_once("G28\nG1 X10 Y10 F600\n"),
              StartsWith("in.gcode:2: where the tool is has not been told since G28 in line 1;"));
  EXPECT_THAT(at_once("G28\nG91\nG1 X10 Y10 Z10 F600\n"), StartsWith("in.gcode:3: where the tool"));
  EXPECT_THAT(at_once("G28\nG2 X10 Y10 Z1 I5 F600\n"),
              StartsWith("in.gcode:2: this move begins at a place"));
  EXPECT_THAT(at_once("G28\nG1 E5 F300\nG1 X10 Y10 Z10\n"), StartsWith("G28\nG1 E5 F300\nG1 X"));
}

TEST(TranslateRefuses, MovesBehindMotorsThatWereOff) {
  EXPECT_THAT(refusal("G28\nM84\nG1 X1 Y1 Z1 F600\n"),
              StartsWith("in.gcode:3: this line moves the tool, and the motors have been off since "
                         "M84 in line 2; home"));
  EXPECT_EQ(refusal("G28\nM84\nG28\nM18\n"), "G28\nM84\nG28\nM18\n");
}

TEST(TranslateRefuses, HomingOfSomeJoints) {
  for (const std::string line : {"G28 X", "G28 X0 Y0", "G28 W", "G28 O", "G28.1", "G28 X Y Z R5"}) {
    EXPECT_THAT(refusal(line + "\n"), StartsWith("in.gcode:1: G28 with words")) << line;
  }
  EXPECT_EQ(refusal("G28 X0 Y0 Z0\nG28\n"), "G28 X0 Y0 Z0\nG28\n");
}

TEST(TranslateRefuses, BedLevelling) {
  for (const std::string line :
       {"G29", "G29 A", "M420 S1", "BED_MESH_CALIBRATE", "BED_MESH_PROFILE LOAD=default",
        "bed_mesh_clear", "M421 X1", "Z_TILT_ADJUST", "QUAD_GANTRY_LEVEL", "G30", "M375"}) {
    for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
      EXPECT_THAT(refusal("G28\n" + line + "\n", firmware), StartsWith("in.gcode:2: ")) << line;
    }
    EXPECT_THAT(refusal("G28\n" + line + "\n"), HasSubstr("bed levelling")) << line;
  }
}

TEST(TranslateRefuses, ShiftsOfAxes) {
  for (const std::string line :
       {"G92 X0", "G92 X0 Y0 Z0", "G92 Z0.2 E0", "G92", "SET_GCODE_OFFSET Z=0.1", "M290 Z0.1",
        "M206 Z1", "M665 L1", "SKEW_PROFILE LOAD=a", "SET_SKEW XY=1,2,3", "G20", "G93"}) {
    EXPECT_THAT(refusal("G28\n" + line + "\n"), StartsWith("in.gcode:2: ")) << line;
  }
  EXPECT_EQ(refusal("G28\nG92 E0\n"), "G28\nG92 E0\n");
}

TEST(TranslateRefuses, WhatMayMove) {
  for (const std::string line :
       {"START_PRINT", "PAUSE", "M600", "G27", "G12", "G5 X1 Y1", "T1", "G53", "G54", "G61", "M125",
        "FORCE_MOVE STEPPER=a", "M701", "G38.2 Z1", "M48", "M81.5 P", "M98 P\"a\""}) {
    for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
      EXPECT_THAT(refusal("G28\n" + line + "\n", firmware), StartsWith("in.gcode:2: ")) << line;
    }
  }
  EXPECT_THAT(refusal("START_PRINT\n"),
              StartsWith("in.gcode:1: START_PRINT may move the machine, and its moves would be of "
                         "joints; write"));
  EXPECT_THAT(refusal("G28\nG1 Xa F600\n"), StartsWith("in.gcode:2: this line is not understood"));
  EXPECT_THAT(refusal("G28\nG1 X5 A3 F600\n"), StartsWith("in.gcode:2: this line is not"));
  EXPECT_THAT(refusal("G28\nif true\n  G1 X5\n", Firmware::rrf), StartsWith("in.gcode:2: "));
  EXPECT_THAT(refusal("G28\nSAVE_GCODE_STATE NAME=a\nG1 X5 F600\n"
                      "RESTORE_GCODE_STATE NAME=a MOVE=1\n"),
              StartsWith("in.gcode:4: "));
}

TEST(TranslateRefuses, PlacesThatAToolChangeMayHaveLost) {
  EXPECT_THAT(refusal("T0\nG28\nG1 X10 F600\n"), StartsWith("T0\nG28\nG1 X10 Y10"));
  EXPECT_THAT(refusal("G28\nT0\nG1 X10 F600\n"),
              StartsWith("in.gcode:3: where the tool is has not been told since T0 in line 2;"));
}

TEST(TranslateRefuses, PlacesThatRepRapFirmwareLosesWhenItSelectsATool) {
  EXPECT_THAT(refusal("G28\nM109 S200\nG1 X10 F600\n", Firmware::rrf),
              StartsWith("in.gcode:3: where the tool is has not been told since M109 in line 2;"));
  EXPECT_THAT(refusal("M109 S200\nG28\nG1 X10 F600\n", Firmware::rrf), StartsWith("M109 S200\n"));
  EXPECT_THAT(refusal("M109 S200 T1\n", Firmware::rrf), StartsWith("in.gcode:1: M109 changes"));
}

TEST(TranslateRefuses, HopsOfTheFirmware) {
  EXPECT_THAT(refusal("G28\nM207 S1 F1800 Z0.4\nG1 X5 F600\nG10\n", Firmware::rrf),
              StartsWith("in.gcode:4: G10 moves the tool by the firmware's own rules"));
  TranslatorOptions options = translating(tripteron(), Firmware::marlin);
  options.interpreter.firmware_retraction = true;
  options.interpreter.retract_length_mm = 1.0;
  EXPECT_EQ(translated("G28\nG10\nG11\n", options), "G28\nG10\nG11\n");
  options.interpreter.retract_z_hop_mm = 0.5;
  EXPECT_THAT(translated("G28\nG10\n", options), StartsWith("in.gcode:2: G10 moves"));
  EXPECT_THAT(translated("G28\nM83\nM209 S1\nG1 E-2 F1800\n", options),
              StartsWith("in.gcode:4: this line becomes the firmware's own retraction"));
}

TEST(TranslateRefuses, SeveralCommandsInALine) {
  for (const std::string line : {"M84 G1 X5", "T0 G1 X5", "M18 M84", "G28 G1 X5", "M106 S1 G1 X5",
                                 "G4 P1 G0 Z5", "G92 E0 G1 X5", "G90 G1 X5", "M109 S200 G1 X5",
                                 "G28 {X}", "G28 X{1}", "G1 X{1}", "T{0}", "M84 {X}", "G91 {1}"}) {
    EXPECT_THAT(refusal("G28\n" + line + "\nG1 X1 Y1 Z1 F600\n", Firmware::rrf),
                StartsWith("in.gcode:"))
        << line;
  }
}

TEST(TranslateRefuses, LinesThatCannotBeTakenApart) {
  EXPECT_THAT(refusal("G28\nG1 X1 X2 F600\n"), StartsWith("in.gcode:2: a second command"));
  EXPECT_THAT(refusal("G28\nN5 G1 X1 F600\n"), StartsWith("in.gcode:2: the line has a number"));
  EXPECT_THAT(refusal("G28\nG91 M83\n", Firmware::rrf), StartsWith("in.gcode:2: this line sets"));
}

TEST(TranslateRefuses, PlacesThatTheMachineCannotReach) {
  TranslatorOptions options = translating(tripteron());
  options.machine.ranges_mm[2] = {0.0, 200.0};
  EXPECT_EQ(translated("G28\nG1 X100 F600\nG1 Z150\n", options),
            "in.gcode:3: the tool cannot be at X100 Y0 Z101: joint C would have to be at 201 mm, "
            "and its range is 0 to 200; place the print elsewhere, or correct the keys of "
            "kinematics if they are wrong");
  options.home_mm = kinematics::Point{-1.0, 0.0, 0.0};
  EXPECT_THAT(translated("G28\n", options),
              StartsWith("in.gcode:1: kinematics.home_mm is where G28 leaves the tool, but"));
}

TEST(TranslateRefuses, PlacesInTheMiddleOfAMove) {
  TranslatorOptions options = translating(tripteron());
  kinematics::Tripteron legs{.linear = std::get<kinematics::Linear>(options.machine.mechanism),
                             .legs = {},
                             .bars = {.upper_mm = 180.0, .lower_mm = 100.0}};
  // In the middle, at Y55 Z40, the legs are 70.7 mm long, and folded they are 80.
  legs.legs.fill({.rail_y_mm = 80.0, .rail_z_mm = 0.0, .tool_joint_mm = {-20.0, 25.0, 10.0}});
  options.machine.mechanism = legs;
  options.home_mm = kinematics::Point{0.0, -20.0, 40.0};
  EXPECT_THAT(translated("G28\nG1 Y-10 F600\nG1 Y130\n", options),
              StartsWith("in.gcode:3: the tool cannot be at X0 Y-6 Z40: leg B would have to be "));
  EXPECT_EQ(lines_of(translated("G28\nG1 Z80 F600\nG1 Y130\nG1 Z40\n", options)), 4);
}

TEST(TranslateRefuses, PlacesBeyondTheRodsOfADelta) {
  constexpr double kThird = 2.0 * std::numbers::pi / 3.0;
  const TranslatorOptions options =
      translating({.mechanism = kinematics::delta_on_circle(125.0, 250.0, {0.0, kThird, -kThird}),
                   .ranges_mm = {}});
  EXPECT_THAT(translated("G28\nG1 X80 F600\nG1 X-300\n", options),
              StartsWith("in.gcode:3: the tool cannot be at X-1"));
  // A line from an unknown place cannot be cut.
  EXPECT_THAT(translated("G1 X0 Y0 Z5 F600\n", options),
              StartsWith("in.gcode:1: this move begins at a place that has not been told"));
}

TEST(TranslateRefuses, OutputsOfUnflex) {
  EXPECT_THAT(refusal("G28\n;unflex run\n"),
              StartsWith("in.gcode:2: this file was already compensated by unflex"));
  EXPECT_THAT(refusal("G28\n; unflex joints: 1 moves\n"),
              StartsWith("in.gcode:2: this file was already translated"));
}

TEST(TranslateWarns, OfLimitsThatAreOfJoints) {
  std::istringstream stream("M201 X500 Y500\nM203 X5\n");
  gcode::LineReader reader(stream, "in.gcode");
  Translator translator(translating(tripteron(), Firmware::marlin), "in.gcode");
  std::string text;
  for (gcode::Line line; reader.next(line).value();) {
    ASSERT_TRUE(translator.translate(line, text));
  }
  ASSERT_EQ(translator.warnings().size(), 1);
  EXPECT_THAT(to_string(translator.warnings().front()),
              StartsWith("in.gcode:1: warning: M201 limits X, Y and Z, which are joints here;"));
}

}  // namespace
}  // namespace unflex::flow
