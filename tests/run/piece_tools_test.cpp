// Which tool each piece of a print is for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "unflex/run/piece_reader.hpp"

namespace unflex::run {
namespace {

using ::testing::ElementsAre;

// Pieces as their first line and their tool: "G28 0".
std::vector<std::string> tools_of(const std::string& text, Firmware firmware,
                                  std::vector<int> told) {
  std::istringstream stream(text);
  gcode::InterpreterOptions options = gcode::default_options(firmware);
  options.tools = std::move(told);
  planner::FirmwareConfig fixed;
  fixed.firmware = firmware;
  PieceReader reader(stream, "in.gcode", options, {}, fixed);
  std::vector<std::string> tools;
  Piece piece;
  for (Result<bool> more = reader.next(piece); !more || *more; more = reader.next(piece)) {
    if (!more) {
      tools.push_back(to_string(more.error()));
      return tools;
    }
    tools.push_back(std::string(piece.events.front().line.content()) + " " +
                    std::to_string(piece.tool));
  }
  return tools;
}

const std::string kTwice =
    "G28\nG90\nM83\nT1\nG1 Z1\nG1 X9 Y9 F6000\nG1 X20 Y9 E1\nG1 X20 Y20 E1\nT1\nM117 same\nT0\n"
    "M117 first\nT-1\n";

TEST(Pieces, HaveTheToolThatTheLastLineSelected) {
  for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
    EXPECT_THAT(tools_of(kTwice, firmware, {0, 1}),
                ElementsAre("G28 0", "T1 1", "G1 X20 Y9 E1 1", "T1 1", "T0 0"))
        << to_string(firmware);
  }
}

TEST(Pieces, HaveTheToolOfKlippersExtruder) {
  EXPECT_THAT(
      tools_of("G28\nACTIVATE_EXTRUDER EXTRUDER=extruder1\nM117 a\n", Firmware::klipper, {0, 1}),
      ElementsAre("G28 0", "ACTIVATE_EXTRUDER EXTRUDER=extruder1 1"));
}

TEST(Pieces, OfAPrinterWithoutToolsAreAsEver) {
  EXPECT_THAT(tools_of(kTwice, Firmware::klipper, {}),
              ElementsAre("G28 0", "G1 X20 Y9 E1 0", "T1 0"));
}

TEST(Pieces, EndWithAnErrorAtAToolThatIsNotTold) {
  EXPECT_EQ(tools_of("G28\nT2\nG1 X1\n", Firmware::rrf, {0, 1}).back(),
            "in.gcode:2: tool 2 is selected, but the printer file has no [tool.2]; add it, empty "
            "if the tool swings as the printer itself");
}

}  // namespace
}  // namespace unflex::run
