// Every message of the interpreter about lines that are wrong or that a printer may not follow,
// with a line that causes it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "interpreting.hpp"

namespace unflex::gcode {
namespace {

using ::testing::ElementsAre;

struct Told {
  Firmware firmware;
  std::string lines;    // the last one causes the message
  std::string message;  // the whole message
};

const std::string kPassed = ": passed through unchanged; check the line";
const std::string kFromHere = ": what follows is passed through unchanged";
const std::string kAtOrigin = "G90\nG1 X0 Y0 Z0 E0 F600\n";

constexpr Firmware kK = Firmware::klipper;
constexpr Firmware kM = Firmware::marlin;
constexpr Firmware kR = Firmware::rrf;

std::vector<Told> all() {
  return {
      // lines as such
      {kK, "X", "'X' without a number" + kPassed},
      {kK, "G1 X1..2", "cannot read 'X1..2'" + kPassed},
      {kK, "FOO BAR", "'BAR' is not of the form KEY=VALUE" + kPassed},
      {kK, "FOO A='1", "a quote is not closed" + kPassed},
      {kK, "G1 X1*5", "the checksum is 5 but should be 63" + kPassed},
      {kK, "\xef\xbb\xbfG28",
       "a byte order mark, which printers take for part of the command; save without it" + kPassed},
      {kK, "G1 X1 (a comment)", "parentheses, which are no comment to Klipper" + kPassed},
      {kK, "(a comment) G1 X1", "parentheses, which are no comment to Klipper" + kPassed},
      {kK, "G01 X1",
       "Klipper knows no command that is written with a blank or a zero before its number" +
           kPassed},
      {kK, "G1 AX1",
       "letters without a number between them, which are one word to Klipper" + kPassed},
      {kK, "M220 S50 %", "more than a number behind a letter, which Klipper refuses" + kPassed},
      {kK, "G20", "Klipper refuses G20, and ends the print"},
      {kR, "G 1 X1", "a blank before the command's number, which RepRapFirmware refuses" + kPassed},
      {kR, "G1 X1 (a comment)",
       "parentheses, which are a comment to RepRapFirmware on a CNC machine alone" + kPassed},
      {kR, "G1 X1E1",
       "an E right behind a number, which is an exponent to RepRapFirmware" + kPassed},
      {kR, "M201 X1000E500",
       "an E right behind a number, which is an exponent to RepRapFirmware" + kFromHere},
      {kM, "G1 X1 (a comment)",
       "a comment in parentheses, which Marlin reads only if PAREN_COMMENTS is set" + kPassed},
      {kM, "g1 x1",
       "lower case, which Marlin reads only if GCODE_CASE_INSENSITIVE is set" + kPassed},
      {kM, "G1 X1\rG1 X2",
       "a carriage return without a line feed, which ends the line for Marlin" + kPassed},
      {kR, "G1 X1 X2", "two commands in one line, or a word given twice" + kPassed},
      {kK, "G1 X1 X2", "a word is given twice, and the last one counts; check the line"},
      {kM, "G1 X1 G1 X2",
       "the second command in the line counts for nothing; give it a line of its own"},
      // moves
      {kK, "G1 X", "a motion word has no number" + kPassed},
      {kK, "G1 X1 F0", "F must be above zero, or Klipper refuses the line" + kPassed},
      {kR, "G1 X1 F0", "F must be above zero, or the printer creeps" + kPassed},
      {kK, kAtOrigin + "G1 X2000000000",
       "the move leads further than any machine reaches" + kPassed},
      {kR, "G93\nG1 X1 F1", "a move in inverse time mode (G93)" + kPassed},
      // arcs
      {kK, kAtOrigin + "G2 X1", "an arc without a centre" + kPassed},
      {kK, kAtOrigin + "G91\nG2 X1 I1",
       "an arc in relative mode (G91), which Klipper refuses" + kPassed},
      {kK, kAtOrigin + "G2 X1 R1", "an arc with R, which Klipper refuses" + kPassed},
      {kR, kAtOrigin + "G2 X10 R1", "an arc whose radius is too small to reach its end" + kPassed},
      {kK, kAtOrigin + "G2 X1 I-100000", "an arc of too many pieces" + kPassed},
      {kM, kAtOrigin + "G2 X-1 I5", "an arc of no angle, which Marlin leaves out" + kPassed},
      {kM, kAtOrigin + "G18\nG2 X1 I1", "an arc outside the XY plane" + kPassed},
      {kK, kAtOrigin + "G2 X10 I4",
       "the arc's end is 2.00 mm off its circle: the printer goes there straight; check the line"},
      // settings
      {kK, "G4 P-5", "G4 without a valid P: no pause is counted"},
      {kM, "G4 P-5", "G4 with a negative time: no pause is counted"},
      {kK, "G92 X", "G92 with X but no number" + kPassed},
      {kK, "M204 S0", "M204 with an invalid S is ignored"},
      {kK, "M220 S0", "M220 with an invalid S is ignored"},
      {kM, "M220 S0", "M220 with an invalid S is ignored"},
      {kR, "M220 S0", "M220 with an invalid S is ignored"},
      {kK, "M221 S-1", "M221 with an invalid S is ignored"},
      {kM, "M221 S-1", "M221 with an invalid S is ignored"},
      {kR, "M221 S-1", "M221 with an invalid S is ignored"},
      {kM, "M203 X-1", "M203 with an invalid X is ignored"},
      {kM, "M205 J0.5", "M205 with J outside 0.01 to 0.3 is ignored"},
      {kM, "M200 D-1", "M200 with an invalid D is ignored"},
      {kM, "M207 S-1", "M207 with an invalid S is ignored"},
      {kR, "M207 Z-1", "M207 with an invalid Z is ignored"},
      {kM, "G20", "Marlin reads G20 only if INCH_MODE_SUPPORT is set"},
      {kM, "M92 X100",
       "M92 sets 100 steps per mm along X, but printer.x_steps_per_mm is 80; they must agree"},
      {kM, "M502",
       "M502 may change the limits to ones not in this file; those known so far are kept"},
      {kK, "SET_VELOCITY_LIMIT VELOCITY=0", "SET_VELOCITY_LIMIT with an invalid value is ignored"},
      {kK, "SET_INPUT_SHAPER SHAPER_FREQ_X=fast",
       "SET_INPUT_SHAPER with an invalid value is ignored"},
      {kK, "SET_RETRACTION RETRACT_LENGTH=-1",
       "SET_RETRACTION with an invalid RETRACT_LENGTH is ignored"},
      {kK, "SET_GCODE_OFFSET X=much", "SET_GCODE_OFFSET with a value that is no number" + kPassed},
      {kK, "RESTORE_GCODE_STATE NAME=x",
       "RESTORE_GCODE_STATE of a state this file does not save" + kPassed},
      // RepRapFirmware's language
      {kR, "if true\n  G91", "a mode or a limit set under a condition" + kFromHere},
      {kR, "M220 S{global.speed}", "a factor set by an expression" + kFromHere},
      {kR, "M204 P{global.accel}", "a limit set by an expression" + kFromHere},
  };
}

TEST(Messages, TellWhatIsWrongWithALine) {
  for (const Told& told : all()) {
    Session session(default_options(told.firmware));
    EXPECT_THAT(session.read(told.lines).warnings, ElementsAre(told.message))
        << to_string(told.firmware) << "\n"
        << told.lines;
  }
}

}  // namespace
}  // namespace unflex::gcode
