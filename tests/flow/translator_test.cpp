// Lines of motion as those of joints.
#include "translator.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "translating.hpp"

namespace unflex::flow {
namespace {

using kinematics::Joints;
using kinematics::Point;
using ::testing::HasSubstr;
using ::testing::Not;

std::string on_tripteron(const std::string& program) {
  return translated(program, translating(tripteron()));
}

TEST(Translator, WritesTheJointsOfATripteron) {
  // The first move begins at an unknown place: √2 mm of joints per mm of the tool at least. Lengths
  // of joints per mm of the tool are √3 along X, √2 along Y and √3 along Z.
  TranslatorOptions options = translating(tripteron());
  options.home_mm.reset();
  EXPECT_EQ(translated("G28\nG90\nG1 X100 Y100 Z0.2 F3600\nG1 X110\nG1 Y120 F3600\nG1 Z0.6 F600\n",
                       options),
            "G28\nG90\nG1 X199.8 Y-0.2 Z100.2 F5091.17\nG1 X209.8 Y9.8 Z110.2 F6235.38\n"
            "G1 X229.8 Y-10.2 Z110.2 F5091.17\nG1 X229.4 Y-10.6 Z110.6 F1039.23\n");
}

TEST(Translator, WritesTheJointsOfACoreXy) {
  const kinematics::Machine machine = machine_of(Motors(Kinematics::corexy, Firmware::klipper));
  EXPECT_EQ(translated("G28\nG1 X10 F6000\nG1 Y10\n", translating(machine)),
            "G28\nG1 X10 Y10 Z0 F8485.28\nG1 X20 Y0 Z0\n");
}

TEST(Translator, BeginsWhereHomingLeavesTheTool) {
  TranslatorOptions options = translating(
      machine_of(Motors(Kinematics::tripteron, Firmware::klipper), Joints{-85.0, -90.0, 230.0}));
  options.home_mm = Point{10.0, 20.0, 30.0};
  // A = 10 + 20 − 30 − 85.
  EXPECT_EQ(translated("G28\nG1 Z40 F600\n", options), "G28\nG1 X-95 Y-140 Z280 F1039.23\n");
}

TEST(Translator, KeepsAllElseOfALine) {
  EXPECT_EQ(on_tripteron("G28\nM83\n"
                         "g0 x 10 S5 E.0400 f600 ; wall\r\n"
                         "  G1X20E0.1;no blanks\n"
                         ";TYPE:Wall\n\n M117 G1 X5 \nG4 P5\nM107 ; off\n"
                         "G1 X30"),
            "G28\nM83\n"
            "g0 X10 Y10 Z10 S5 E.0400 F1039.23 ; wall\r\n"
            "G1 X20 Y20 Z20 E0.1;no blanks\n"
            ";TYPE:Wall\n\n M117 G1 X5 \nG4 P5\nM107 ; off\n"
            "G1 X30 Y30 Z30");
}

TEST(Translator, GivesFilamentAloneItsSpeedAgain) {
  EXPECT_EQ(on_tripteron("G28\nM83\nG1 X10 F600\nG1 E-1 ; back\nG1 E1\nG1 E2 F300\nG1 F600\n"
                         "G1 X20\n"),
            "G28\nM83\nG1 X10 Y10 Z10 F1039.23\nG1 E-1 F600 ; back\nG1 E1\nG1 E2 F300\nG1 F600\n"
            "G1 X20 Y20 Z20 F1039.23\n");
}

TEST(Translator, WritesReadingsWhereTheFileHasDifferences) {
  const std::string program =
      "G28\nM82\nG1 X10 E1 F600\nG91 ; relative\nG1 X5\nG1 Z1 E-1\nM82\nG90\nG1 X0 E2\n";
  // Klipper's G91 is of E, too, whatever M82 says.
  EXPECT_EQ(on_tripteron(program),
            "G28\nM82\nG1 X10 Y10 Z10 E1 F1039.23\nM83 ; relative\nG1 X15 Y15 Z15\n"
            "G1 X14 Y14 Z16 E-1\nM82\nM83\nG90\nM82\nG1 X-1 Y-1 Z1 E2\n");
  const std::string on_marlin = translated(program, translating(tripteron(), Firmware::marlin));
  EXPECT_THAT(on_marlin, HasSubstr("\nM83 ; relative\n"));
  EXPECT_THAT(on_marlin, HasSubstr("\nM82\nG90\nG1 X-1 Y-1 Z1 E2\n"));
  // With RepRapFirmware G91 is not of E.
  const std::string on_rrf = translated(program, translating(tripteron(), Firmware::rrf));
  EXPECT_THAT(on_rrf, HasSubstr("\nM82 ; relative\n"));
}

TEST(Translator, TellsThePlaceOfALineThatGoesNowhere) {
  EXPECT_EQ(on_tripteron("G28\nG1 X10 F600\nG1 X10 F900\nG1 X10 E1 F900\n"),
            "G28\nG1 X10 Y10 Z10 F1039.23\nG1 X10 Y10 Z10 F900\nG1 X10 Y10 Z10 E1\n");
}

TEST(Translator, MakesLinesOfArcs) {
  const std::string text =
      on_tripteron("G28\nM83\nG1 X10 Y0 F600\nG2 X20 Y10 I10 J0 E1 S3 F1200 ; arc\n");
  EXPECT_THAT(text, Not(HasSubstr("G2 ")));
  EXPECT_THAT(text, HasSubstr(" ; arc\nG1 X"));
  const auto options = gcode::default_options(Firmware::klipper);
  const auto moves = play(text, options, {});
  EXPECT_EQ(moves.size(), 16);  // 15.7 mm in pieces of 1 mm
  EXPECT_NEAR(moves.back().e_mm, 1.0, 1e-9);
  EXPECT_THAT(text, HasSubstr("X30 Y10 Z20"));
}

TEST(Translator, GoesOnBehindLabelsOfObjects) {
  // If the object is cancelled, nobody has told the last line its speed.
  EXPECT_EQ(on_tripteron("G28\nG1 X10 F600\nEXCLUDE_OBJECT_START NAME=a\nG1 X20\n"
                         "EXCLUDE_OBJECT_END NAME=a\nG1 X30\nG1 X40\n"),
            "G28\nG1 X10 Y10 Z10 F1039.23\nEXCLUDE_OBJECT_START NAME=a\n"
            "G1 X20 Y20 Z20 F1039.23\nEXCLUDE_OBJECT_END NAME=a\nG1 X30 Y30 Z30 F1039.23\n"
            "G1 X40 Y40 Z40\n");
  EXPECT_EQ(on_tripteron("G28\nG1 X10 F600\nEXCLUDE_OBJECT_START NAME=a\nG1 Y10\n"
                         "EXCLUDE_OBJECT_END NAME=a\nG1 X20\n"),
            "G28\nG1 X10 Y10 Z10 F1039.23\nEXCLUDE_OBJECT_START NAME=a\n"
            "G1 X20 Y0 Z10 F848.53\nEXCLUDE_OBJECT_END NAME=a\nG1 X30 Y10 Z20 F1039.23\n");
}

kinematics::Machine delta() {
  const double third = 2.0 * std::numbers::pi / 3.0;
  return {.mechanism = kinematics::delta_on_circle(125.0, 250.0, {0.0, third, 2.0 * third}),
          .ranges_mm = {}};
}

// The place of the tool where the joints are a share of the way from one place to another.
Point between(const kinematics::Machine& machine, const gcode::Segment& segment, double share) {
  Joints q{};
  for (std::size_t i = 0; i < q.size(); ++i) {
    q[i] = segment.start_mm[i] + share * segment.delta(static_cast<gcode::Axis>(i));
  }
  return to_point(machine, q).value();
}

TEST(Translator, CutsTheLinesOfADelta) {
  const TranslatorOptions options = translating(delta());
  const auto home = to_joints(options.machine, {}).value();
  for (const std::string mode : {"M82", "M83"}) {
    const std::string text =
        translated("G28\n" + mode + "\nG1 Z10 E0.5 F3000\nG1 X80 Y20 E3.141592 ; long\n", options);
    EXPECT_EQ(text.find("\nG1 X80"), std::string::npos);
    const auto moves = play(text, options.interpreter, home);
    ASSERT_GT(moves.size(), 20);
    EXPECT_NEAR(moves.back().e_mm, mode == "M82" ? 3.141592 : 3.641592, 1e-9);
    double duration_s = 0.0;
    for (std::size_t i = 1; i < moves.size(); ++i) {
      const gcode::Segment& segment = moves[i].segments.front();
      duration_s += moves[i].duration_s;
      const Point end = between(options.machine, segment, 1.0);
      const double done = std::hypot(end[0], end[1]) / std::hypot(80.0, 20.0);
      const double e_of_line = mode == "M82" ? 2.641592 : 3.141592;
      EXPECT_NEAR(moves[i].e_mm - 0.5, e_of_line * done, 1e-4);
      for (const double share : {0.25, 0.5, 0.75}) {
        const Point p = between(options.machine, segment, share);
        const double across = (p[1] * 80.0 - p[0] * 20.0) / std::hypot(80.0, 20.0);
        EXPECT_LT(std::hypot(across, p[2] - 10.0), options.tolerance_mm + 3e-4);
      }
    }
    EXPECT_NEAR(duration_s, std::hypot(80.0, 20.0) / 50.0, 1e-4);
  }
}

TEST(Translator, LeavesStraightUpOfADeltaWhole) {
  EXPECT_EQ(lines_of(translated("G28\nG1 Z10 F3000\n", translating(delta()))), 2);
}

// A program of moves in both modes, with filament, without, and lines between.
std::string random_program(std::mt19937& random) {
  std::uniform_real_distribution<double> place(-50.0, 50.0);
  const auto chance = [&](double share) { return (place(random) + 50.0) / 100.0 < share; };
  const auto number = [&](double value) { return std::to_string(std::round(value * 1e3) / 1e3); };
  std::string text = "G28\n";
  text += chance(0.5) ? "M83\n" : "M82\n";
  bool is_relative = false;
  for (int i = 0; i < 40; ++i) {
    if (chance(0.1)) {
      is_relative = !is_relative;
      text += is_relative ? "G91\n" : "G90\n";
    }
    if (chance(0.05)) {
      text += chance(0.5) ? "M82\n" : "M83\n";
    }
    text += chance(0.1) ? "G92 E0\n" : chance(0.1) ? ";note\n" : "";
    text += chance(0.3) ? "G0" : "G1";
    const double scale = is_relative ? 0.02 : 1.0;
    for (const char axis : {'X', 'Y', 'Z'}) {
      text += chance(0.5) ? std::string(" ") + axis + number(scale * place(random)) : "";
    }
    text += chance(0.5) ? " E" + number(0.02 * place(random)) : "";
    text += chance(0.3) || i == 0 ? " F" + std::to_string(600 + std::abs(place(random)) * 60) : "";
    text += chance(0.2) ? " ; a comment\n" : "\n";
  }
  return text;
}

void compare(const std::string& program, const std::string& text,
             const TranslatorOptions& options) {
  const Point home = *options.home_mm;
  const auto sliced = play(program, options.interpreter, home);
  const auto written = play(text, options.interpreter, to_joints(options.machine, home).value());
  ASSERT_EQ(sliced.size(), written.size()) << program << text;
  for (std::size_t i = 0; i < sliced.size(); ++i) {
    ASSERT_EQ(sliced[i].segments.size(), written[i].segments.size());
    const gcode::Segment& meant = sliced[i].segments.back();
    const gcode::Segment& done = written[i].segments.back();
    const Point p = to_point(options.machine, place_of(done.end_mm)).value();
    ASSERT_LT(distance_mm(p, place_of(meant.end_mm)), 2e-4) << program << text;
    ASSERT_NEAR(written[i].e_mm, sliced[i].e_mm, 1e-9) << program << text;
    ASSERT_NEAR(written[i].duration_s, sliced[i].duration_s, 1e-4) << program << text;
  }
}

TEST(Translator, DrawsTheSlicedPathOfRandomPrograms) {
  std::mt19937 random(20);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  for (int round = 0; round < 150; ++round) {
    Motors::Rows rows{};
    do {
      for (Motors::Row& row : rows) {
        row = {number(random), number(random), number(random)};
      }
    } while (Motors::fault(rows) || kinematics::norm_of_inverse(rows) > 2.0);
    for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
      TranslatorOptions options =
          translating(machine_of(Motors(rows), {100.0 * number(random), 0.0, 50.0}), firmware);
      options.home_mm = Point{number(random), 20.0, 30.0};
      // With as many digits as the programs give a place.
      options.home_mm->front() = std::round(options.home_mm->front() * 1e3) / 1e3;
      const std::string program = random_program(random);
      const std::string text = translated(program, options);
      ASSERT_NO_FATAL_FAILURE(compare(program, text, options));
      EXPECT_GE(lines_of(text), lines_of(program));
      if (program.find("G91") == std::string::npos) {
        EXPECT_EQ(lines_of(text), lines_of(program)) << program << text;
      }
    }
  }
}

}  // namespace
}  // namespace unflex::flow
