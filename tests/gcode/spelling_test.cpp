// Lines whose spelling makes printers read them differently.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

Session session_of(Firmware firmware) { return Session(default_options(firmware)); }

// gcode.py, _process_commands.
TEST(Spelling, KeepsKlipperFromCarryingLinesOut) {
  for (const char* const line : {"M083", "M 83", "M83 (relative)", "(relative) M83", "M83 %"}) {
    Session session = session_of(Firmware::klipper);
    EXPECT_THAT(session.read(line).warnings, SizeIs(1)) << line;
    EXPECT_TRUE(session.state().absolute_e) << line;
  }
  for (const char* const line : {"G091", "G 91", "G91 (relative)", "(relative) G91"}) {
    Session session = session_of(Firmware::klipper);
    EXPECT_THAT(session.read(line).warnings, SizeIs(1)) << line;
    EXPECT_TRUE(session.state().absolute_xyz) << line;
  }
  for (const char* const line : {"M220 S50 %", "M220 S5 0", "M221 S50(%)"}) {
    Session session = session_of(Firmware::klipper);
    EXPECT_THAT(session.read(line).warnings, SizeIs(1)) << line;
    EXPECT_EQ(session.state().speed_factor, 1.0) << line;
    EXPECT_EQ(session.state().flow_factor, 1.0) << line;
  }
}

TEST(Spelling, LeavesNoPlaceKnownWhereTheMoveIsDoubtful) {
  for (const auto& [firmware, line] :
       {std::pair{Firmware::klipper, "G01 X5"}, std::pair{Firmware::klipper, "G1 KX5"},
        std::pair{Firmware::klipper, "G92 KX5"}, std::pair{Firmware::rrf, "G 1 X5"},
        std::pair{Firmware::rrf, "G1 X5E1"}, std::pair{Firmware::rrf, "G1 X5 (E1)"},
        std::pair{Firmware::rrf, "(a) G1 X5"}, std::pair{Firmware::marlin, "(a) G1 X5"}}) {
    Session session = session_of(firmware);
    session.read("G90\nG1 X1 Y1 Z1 E1 F600");
    const Event event = session.read(line);
    EXPECT_TRUE(event.position_lost) << line;
    EXPECT_THAT(event.warnings, SizeIs(1)) << line;
    EXPECT_FALSE(session.state().known[X]) << line;
  }
}

TEST(Spelling, IsNoMatterWhereThePrinterReadsItAsItIsMeant) {
  for (const auto& [firmware, line] :
       {std::pair{Firmware::klipper, "g1x5y5e1"}, std::pair{Firmware::klipper, "  G1 X 5 Y 5"},
        std::pair{Firmware::klipper, "(a comment alone)"},
        std::pair{Firmware::klipper, "G1 X5 ;AX (a)"},
        std::pair{Firmware::klipper, "M117 G01 (a) 5 %"}, std::pair{Firmware::klipper, "M106 S255"},
        std::pair{Firmware::marlin, "G 01 X 5Y5E1"},
        std::pair{Firmware::marlin, "(a comment alone)"}, std::pair{Firmware::rrf, "g01 x5 y5 e1"},
        std::pair{Firmware::rrf, "G1E1X5"}, std::pair{Firmware::rrf, "M106 P0E1"},
        std::pair{Firmware::rrf, "G91 (a)"}}) {
    EXPECT_THAT(session_of(firmware).read(line).warnings, IsEmpty()) << line;
  }
}

// A Marlin with PAREN_COMMENTS takes parentheses as comments, and so does a RepRapFirmware that
// runs a CNC machine.
TEST(Spelling, LeavesModesUncertainThatMayHaveBeenSet) {
  for (const auto& [firmware, line] :
       {std::pair{Firmware::marlin, "(a) G91"}, std::pair{Firmware::rrf, "(a) G91"},
        std::pair{Firmware::rrf, "M566 X600E300"}}) {
    Session session = session_of(firmware);
    session.read("G90\nG1 X1 Y1 Z1 E1 F600");
    session.read(line);
    session.read("G1 X2 Y2 Z2 E2 F600");
    EXPECT_FALSE(session.move("G1 X3 Y2").start_known) << line;
  }
}

}  // namespace
}  // namespace unflex::gcode
