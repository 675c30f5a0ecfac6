// Which lines are reported as unknown.
#include "unflex/gcode/unknown_command.hpp"

#include <gtest/gtest.h>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

std::string unknown(Firmware firmware, const char* line) {
  Session session(default_options(firmware));
  session.read("T0\nG1 X1 Y1 Z1");
  return unknown_command(session.read(line), firmware);
}

TEST(UnknownCommands, HaveTheirName) {
  EXPECT_EQ(unknown(Firmware::klipper, "MY_LAYER_MACRO A=1"), "MY_LAYER_MACRO");
  EXPECT_EQ(unknown(Firmware::klipper, "my_layer_macro"), "MY_LAYER_MACRO");
  for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
    EXPECT_EQ(unknown(firmware, "M1234 S1"), "M1234");
    EXPECT_EQ(unknown(firmware, "N5 M1234 S1"), "M1234");
    EXPECT_EQ(unknown(firmware, "G1009"), "G1009");
  }
  EXPECT_EQ(unknown(Firmware::klipper, "M1234.5"), "M1234.5");
  EXPECT_EQ(unknown(Firmware::marlin, "M622 J1"), "M622");
  EXPECT_EQ(unknown(Firmware::rrf, "M98 P\"layer.g\""), "M98");
}

TEST(UnknownCommands, AreNotThoseThatMoveTheMachineInAKnownWay) {
  for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
    for (const char* line :
         {"", "; M1234", "G1 X2", "G28", "G28 X", "G29", "G92 X0", "T1", "M84", "M600", "M0",
          "M104 S200", "M109 S200", "M400", "M204 P500", "M971", "M202 X100"}) {
      EXPECT_EQ(unknown(firmware, line), "") << line;
    }
  }
  EXPECT_EQ(unknown(Firmware::klipper, "SET_GCODE_OFFSET Z=1 MOVE=1"), "");
  EXPECT_EQ(unknown(Firmware::klipper, "RESPOND TYPE=command MSG=\"action:pause\""), "");
  EXPECT_EQ(unknown(Firmware::marlin, "M118 A1 action:pause"), "");
  EXPECT_EQ(unknown(Firmware::rrf, "if state.upTime > 3"), "");
}

// These lines have a warning of their own, which says more.
TEST(UnknownCommands, AreNotLinesThatAreWarnedOf) {
  EXPECT_EQ(unknown(Firmware::klipper, "Hello, world"), "");
  EXPECT_EQ(unknown(Firmware::klipper, "G1 X3 ?"), "");
  EXPECT_EQ(unknown(Firmware::marlin, "m1234"), "");
}

}  // namespace
}  // namespace unflex::gcode
