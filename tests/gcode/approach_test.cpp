// The line that goes ahead of a travel from an uncertain place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>
#include <string>

#include "gcode/interpreting.hpp"

namespace unflex::gcode {
namespace {

using enum Axis;
using ::testing::Eq;
using ::testing::Optional;

const std::string kLabel = "EXCLUDE_OBJECT_END NAME=a\n";

std::optional<std::string> approach_behind(const std::string& lines, const std::string& travel,
                                           Firmware firmware = Firmware::klipper) {
  Session session(default_options(firmware));
  session.read(lines);
  return session.approach(travel);
}

TEST(Approach, EndsThreeMillimetresAheadOfTheTarget) {
  EXPECT_THAT(approach_behind("G1 X10 Y20 Z1\n" + kLabel, "G0 X40 Y60 F18000"),
              Optional(Eq("G0 X38.2000 Y57.6000 F18000\n")));
}

TEST(Approach, MakesATenthOfAShortWay) {
  EXPECT_THAT(approach_behind("G1 X10 Y20 Z1\n" + kLabel, "G1 X12 Y20"),
              Optional(Eq("G1 X10.2000 Y20.0000\n")));
  EXPECT_EQ(approach_behind("G1 X10 Y20 Z1\n" + kLabel, "G1 X10.05 Y20"), std::nullopt);
}

TEST(Approach, IsWrittenInTheFilesOwnUnitsFromItsOwnZero) {
  EXPECT_THAT(approach_behind("G1 X10 Y20 Z1\nG92 X0\n" + kLabel, "G1 X40 Y20"),
              Optional(Eq("G1 X37.0000 Y20.0000\n")));
  EXPECT_THAT(approach_behind("G20\nG1 X1 Y1 Z1\n" + kLabel, "G1 X2 Y1"),
              Optional(Eq("G1 X1.881890 Y1.000000\n")));
}

TEST(Approach, IsMadeBehindLabelsAndUnknownCommandsOnly) {
  for (const char* line : {"", "M400\n", "G28\n", "T1\n", "EXCLUDE_OBJECT_END\nG28\n"}) {
    EXPECT_EQ(approach_behind(std::string("G1 X10 Y20 Z1\n") + line, "G1 X40 Y60"), std::nullopt)
        << line;
  }
  EXPECT_NE(approach_behind("G1 X10 Y20 Z1\nMY_MACRO\n", "G1 X40 Y60"), std::nullopt);
  EXPECT_NE(approach_behind("G1 X10 Y20 Z1\nM486 S1\n", "G1 X40 Y60", Firmware::marlin),
            std::nullopt);
  EXPECT_NE(approach_behind("G1 X10 Y20 Z1\n; printing object a\n", "G1 X40 Y60", Firmware::rrf),
            std::nullopt);
}

// Behind a label the machine is where it should be, unless the object was cancelled.
TEST(Approach, OfALineThatDrawsLeadsToItsBegin) {
  const std::string before = "M83\nG1 X10 Y20.12345 Z1 F6000\nG92 X0\n" + kLabel;
  for (const char* line : {"G1 X40 Y60 E1", "G1 Y60 E1 F1200", "G3 X10 Y20 I5 E1"}) {
    EXPECT_THAT(approach_behind(before, line), Optional(Eq("G1 X0 Y20.12345\n"))) << line;
  }
  Session session;
  session.read(before);
  const Event ahead = session.read("G1 X0 Y20.12345");
  EXPECT_TRUE(ahead.segments.empty());
  EXPECT_EQ(ahead.kind, EventKind::border);
  EXPECT_TRUE(session.move("G1 X40 Y60 E1").start_known);
  // Behind a macro nobody knows what an absolute E is counted from.
  EXPECT_EQ(approach_behind("G1 X10 Y20 Z1\nMY_MACRO\n", "G1 X40 Y60 E1"), std::nullopt);
}

// Such a move stands as it is, so the nozzle swings behind it.
TEST(Approach, OfALineThatDrawsBehindAMoveFromNowhereIsAPause) {
  InterpreterOptions options = default_options(Firmware::klipper);
  options.settling_s = 0.2;
  const auto ahead = [&](const std::string& lines) {
    Session session(options);
    session.read("M83\nG28\n" + lines);
    return session.approach("G1 X40 Y60 E1");
  };
  EXPECT_THAT(ahead("G1 X10 Y20 Z1 F6000\n"), Optional(Eq("G4 P200\n")));
  EXPECT_THAT(ahead("G1 X10 Y20 Z1 F6000\nG1 E1 F600\n"), Optional(Eq("G4 P100\n")));
  EXPECT_EQ(ahead("G1 X10 Y20 Z1 F6000\nG1 E4 F600\n"), std::nullopt);
  EXPECT_EQ(ahead("G1 X10 Y20 Z1 F6000\nG4 P200\n"), std::nullopt);
  EXPECT_EQ(ahead("G1 X10 Y20 Z1 F6000\nG1 X30 F600\n"), std::nullopt);
  options.shaper_freq_hz.x = options.shaper_freq_hz.y = 45.0;
  EXPECT_EQ(ahead("G1 X10 Y20 Z1 F6000\n"), std::nullopt);
}

TEST(Approach, IsOfPlainTravelOnly) {
  for (const char* line :
       {"G1 E1", "G1 X40", "G1 X40 Y60 Z2", "G2 X40 Y60 I1 J1", "G1 X40 Y60 X41", "G1 X40 Y60 F0",
        "G1 X40 Y60 S1", "M204 S100", "MACRO X=1 Y=2", "N5 G1 X40 Y60"}) {
    EXPECT_EQ(approach_behind("G1 X10 Y20 Z1\n" + kLabel, line), std::nullopt) << line;
  }
  EXPECT_EQ(approach_behind("G1 X10 Y20 Z1\n" + kLabel + "G91\n", "G1 X40 Y60"), std::nullopt);
}

// In every direction the approach and the line together end where the line alone does, along its
// path, and the line starts at a known place.
TEST(Approach, LiesOnTheWay) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-200.0, 200.0);
  for (int i = 0; i < 200; ++i) {
    Session session;
    const auto at = [&] {
      return " X" + std::to_string(place(random)) + " Y" + std::to_string(place(random));
    };
    session.read("G1" + at() + " Z1");
    session.read("G92" + at());
    session.read("MY_MACRO");
    const std::string travel = "G1" + at() + " F6000";
    const std::optional<std::string> ahead = session.approach(travel);
    ASSERT_TRUE(ahead) << travel;
    const Segment first = session.move(*ahead);
    EXPECT_EQ(session.approach(travel), std::nullopt);
    const Segment second = session.move(travel);
    EXPECT_FALSE(first.start_known);
    EXPECT_TRUE(first.start_assumed);
    EXPECT_TRUE(second.start_known);
    const double bend = (first.delta(X) * second.delta(Y) - first.delta(Y) * second.delta(X)) /
                        (first.length_xy_mm() * second.length_xy_mm());
    EXPECT_NEAR(bend, 0.0, 1e-3);
    EXPECT_GT(first.delta(X) * second.delta(X) + first.delta(Y) * second.delta(Y), 0.0);
    EXPECT_NEAR(second.length_xy_mm(), 3.0, 1e-3);
  }
}

}  // namespace
}  // namespace unflex::gcode
