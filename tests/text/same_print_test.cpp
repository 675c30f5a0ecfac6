#include "same_print.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>
#include <string>

namespace unflex::testing {
namespace {

using ::testing::HasSubstr;

const Printer kPrinter = {Firmware::klipper,
                          {0.8, 0.0},
                          {{"accel", 3000.0}, {"shaper X freq", 45.0}, {"shaper Y freq", 45.0}}};

const std::string kSliced = numbered(
    "G28\nG90\nM83\nG1 X10 Y10 Z0.2 F6000\nG1 X20 E1\nG1 Y20 E1\nG92 E0\nG4 P1\nG1 X30 E2\n"
    "M106 S100\n");

const std::string kEmitted =
    "G28\n;line 0\nG90\n;line 1\nM83\n;line 2\nG1 X10 Y10 Z0.2 F6000\n;line 3\n"
    "SET_INPUT_SHAPER SHAPER_FREQ_X=0 SHAPER_FREQ_Y=0\n;unflex run\n"
    "SET_VELOCITY_LIMIT ACCEL=1000000\nG1 X20.5 Y10.1 E1.05 F4000\n;line 4\n"
    "G1 X20 Y20 E.95 F4100\n;line 5\n;unflex end\nG92 E0\n;line 6\n"
    "SET_VELOCITY_LIMIT ACCEL=3000\nG1 F6000\nG4 P1\n;line 7\n"
    "G1 X30 E2\n;line 8\nM106 S100\n;line 9\nSET_INPUT_SHAPER SHAPER_FREQ_X=45 SHAPER_FREQ_Y=45\n";

TEST(SamePrint, IsFoundTheSame) { EXPECT_EQ(difference(kSliced, kEmitted, kPrinter), ""); }

TEST(SamePrint, EndsWhereKlipperRefusesALine) {
  const std::string sliced = numbered("G28\nG20\nG1 X1\n");
  EXPECT_EQ(difference(sliced, "G28\n;line 0\nG20\n;line 1\nG1 X2\n;line 2\n", kPrinter), "");
  EXPECT_THAT(difference(sliced,
                         "G28\n;line 0\n;unflex run\nG1 X0 F60\n;unflex end\n"
                         "SET_VELOCITY_LIMIT ACCEL=3000\nG1 F1500\n;line 1\nG1 X1\n;line 2\n",
                         kPrinter),
              HasSubstr("what is refused is not"));
}

TEST(SamePrint, LetsNoLimitsOfARunHoldForTheMoveBeforeIt) {
  const Printer printer = {Firmware::rrf, {0.8, 0.0}, {{"M204 P", 3000.0}, {"M201 X", 3000.0}}};
  const std::string sliced = numbered("G28\nM83\nG1 E1 F1800\nG1 X10 E1 F6000\nM400\n");
  const std::string before = "G28\n;line 0\nM83\n;line 1\nG1 E1 F1800\n;line 2\n;unflex run\n";
  const std::string lines =
      "M201 X100000\nM204 P100000\nG1 X5 E.5 F5900\nG1 X10 E.5 F5900\n;line 3\n;unflex end\n";
  const std::string after = "M201 X3000\nM204 P3000\nG1 F6000\nM400\n;line 4\n";
  EXPECT_EQ(difference(sliced, before + "G1 F1800\n" + lines + "G1 F5900\n" + after, printer), "");
  EXPECT_THAT(difference(sliced, before + lines + "G1 F5900\n" + after, printer),
              HasSubstr("limits change while a move waits"));
  EXPECT_THAT(difference(sliced, before + "G1 F1800\n" + lines + after, printer),
              HasSubstr("limits change while a move waits"));
}

struct Fault {
  std::string name;
  std::string text;
  std::string instead;
  std::string told;
};

void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }

class SpoiltPrint : public ::testing::TestWithParam<Fault> {};

TEST_P(SpoiltPrint, IsFoundDifferent) {
  std::string spoilt = kEmitted;
  const std::size_t at = spoilt.find(GetParam().text);
  ASSERT_NE(at, std::string::npos);
  spoilt.replace(at, GetParam().text.size(), GetParam().instead);
  EXPECT_THAT(difference(kSliced, spoilt, kPrinter), HasSubstr(GetParam().told));
}

INSTANTIATE_TEST_SUITE_P(
    Of, SpoiltPrint,
    ::testing::Values(
        Fault{"Place", "G1 X20 Y20 E.95", "G1 X20 Y20.001 E.95", "line 7: G4 P1: Y is 20.001 "},
        Fault{"Filament", "E.95", "E.94", "line 7: G4 P1: filament is 1.99 instead of 2"},
        Fault{"Reading", "G92 E0\n", "", "the reading of E is 2 instead of 0"},
        Fault{"Feed", "G1 F6000\n", "", "F is 68.3333333 instead of 100"},
        Fault{"Mode", "M83\n", "M82\n", "M82 and M83 differ"},
        Fault{"Zero", "G92 E0\n", "G92 E0 X19\n", "zero is 1 instead of 0"},
        Fault{"Limit", "ACCEL=3000", "ACCEL=3001", "accel is 3001 instead of 3000"},
        Fault{"LimitOfNobody", "ACCEL=3000\n", "ACCEL=3000 VELOCITY=100\n", "nobody has said"},
        Fault{"LimitOfTheRun", "SET_VELOCITY_LIMIT ACCEL=3000\nG1 F6000\nG4 P1\n;line 7\n",
              "G1 F6000\nG4 P1\n;line 7\n", "motion by the limits of a run"},
        Fault{"Excursion", "X20.5", "X22.1", "a run leaves its lines along X"},
        Fault{"Retraction", "E1.05 F4000", "E-1.05 F4000\nG1 E2.1",
              "a run leaves its lines along E"},
        Fault{"Plunge", "Y10.1", "Y10.1 Z0.1", "Z is 0.1 instead of 0.2"},
        Fault{"LostLine", "M106 S100\n", "", "line 9: M106 S100: the line is lost"},
        Fault{"LostMark", ";line 4\n", "", "lines are out of order"},
        Fault{"LostEnd", "G1 X30 E2\n;line 8\nM106 S100\n;line 9\n", "", "lines are lost"},
        Fault{"EndlessRun", ";unflex end\n", "", "a run does not end"},
        Fault{"Shaper", "SHAPER_FREQ_Y=45", "SHAPER_FREQ_Y=46",
              "shaper Y freq is 46 instead of 45"}),
    [](const auto& tested) { return tested.param.name; });

}  // namespace
}  // namespace unflex::testing
