// The line test has the line rates that it states, within what the firmware can plan.

#include "unflex/machine/line_test.hpp"

#include <fmt/core.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "reading.hpp"
#include "unflex/gcode/command.hpp"

namespace unflex::machine {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Settings read(const std::string& text) {
  Result<Settings> settings = parse(text, "printer", {});
  EXPECT_TRUE(settings) << to_string(settings.error());
  return settings.value_or(Settings{});
}

std::string text_for(const std::string& printer) {
  const Result<std::string> text = line_test(read(printer));
  EXPECT_TRUE(text) << to_string(text.error());
  return text.value_or("");
}

// The moves of a stage as written.
struct Stage {
  double label_lines_per_s = 0.0;
  double label_s = 0.0;
  double y_mm = 0.0;
  double z_mm = 0.0;
  int lines = 0;
  int strokes = 0;
  double way_mm = 0.0;
  double speed_mm_s = 0.0;
};

struct Read {
  std::vector<Stage> stages;
  double x_min_mm = 1e9;
  double x_max_mm = -1e9;
  bool heats_or_extrudes = false;
};

Read stages_of(const std::string& text) {
  Read read;
  std::istringstream stream(text);
  std::string line;
  double x_mm = 0.0;
  double direction = 0.0;
  bool moves = false;
  while (std::getline(stream, line)) {
    const gcode::Command command = gcode::parse(line);
    if (line.starts_with("M117 ") && line.ends_with(" s")) {
      std::sscanf(line.c_str(), "M117 %lf lines/s, %lf s", &read.stages.back().label_lines_per_s,
                  &read.stages.back().label_s);
      moves = true;
      continue;
    }
    read.heats_or_extrudes = read.heats_or_extrudes || command.is('M', 104) ||
                             command.is('M', 109) || command.is('M', 140) || command.has('E');
    if (command.is('M', 400)) {
      moves = false;
    }
    if (!command.is('G', 1) || !command.has('X')) {
      continue;
    }
    const double to_mm = *command.value('X');
    read.x_min_mm = std::min(read.x_min_mm, to_mm);
    read.x_max_mm = std::max(read.x_max_mm, to_mm);
    if (!moves) {
      read.stages.push_back({.y_mm = *command.value('Y'), .z_mm = *command.value('Z')});
      direction = 0.0;
    } else {
      Stage& stage = read.stages.back();
      ++stage.lines;
      stage.way_mm += std::abs(to_mm - x_mm);
      stage.strokes += (to_mm - x_mm) * direction <= 0.0 ? 1 : 0;
      direction = to_mm - x_mm;
      stage.speed_mm_s = *command.value('F') / 60.0;
      EXPECT_EQ(*command.value('Y'), stage.y_mm);
    }
    x_mm = to_mm;
  }
  return read;
}

class LineTest : public ::testing::TestWithParam<const char*> {};

TEST_P(LineTest, AsksForWhatItSays) {
  const Settings settings = read(GetParam());
  const Read test = stages_of(text_for(GetParam()));
  ASSERT_GE(test.stages.size(), 4U);
  EXPECT_FALSE(test.heats_or_extrudes);
  const double accel = std::min(settings.axis_max_accel_mm_s2()[0], settings.travel_accel_mm_s2());
  for (std::size_t i = 0; i < test.stages.size(); ++i) {
    const Stage& stage = test.stages[i];
    const double cruise_s = stage.way_mm / stage.speed_mm_s;
    EXPECT_NEAR(stage.lines / cruise_s, stage.label_lines_per_s, 0.01 * stage.label_lines_per_s);
    // A stroke from rest to rest takes L / v + v / a.
    EXPECT_NEAR(stage.label_s, cruise_s + stage.strokes * stage.speed_mm_s / accel, 0.051);
    EXPECT_GT(stage.label_s, 4.0);
    EXPECT_LT(stage.label_s, 10.0);
    if (i > 0) {
      EXPECT_GT(stage.label_lines_per_s, test.stages[i - 1].label_lines_per_s);
      EXPECT_GT(stage.y_mm, test.stages[i - 1].y_mm);
      EXPECT_GT(stage.z_mm, test.stages[i - 1].z_mm);
    }
  }
  EXPECT_LE(test.stages.front().label_lines_per_s, settings.max_lines_per_s() / 2.0);
  EXPECT_GE(test.stages.back().label_lines_per_s, 2.0 * settings.max_lines_per_s());
  if (const auto travel = settings.printer.travel_mm.x) {
    EXPECT_GE(test.x_min_mm, travel->min);
    EXPECT_LE(test.x_max_mm, travel->max);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Printers, LineTest,
    ::testing::Values("", "[printer]\ntravel_x_mm = [-100, 100]\ntravel_y_mm = [-100, 100]\n",
                      "[printer]\nfirmware = \"marlin\"\n[limits]\nmax_accel_mm_s2 = 3000\n",
                      "[printer]\nfirmware = \"rrf\"\ntransport = \"sbc\"\n"));

// Marlin joins shorter lines to the next one, and plans 16 ahead.
TEST(LineTest, KeepsMarlinsLinesLongEnough) {
  const Settings settings =
      read("[printer]\nfirmware = \"marlin\"\n[limits]\nmax_accel_mm_s2 = 500\n");
  const std::vector<LineTestStage> stages = line_test_stages(settings);
  ASSERT_FALSE(stages.empty());
  EXPECT_LT(stages.back().lines_per_s, 1000.0);
  for (const LineTestStage& stage : stages) {
    const double line_mm = stage.speed_mm_s / stage.lines_per_s;
    EXPECT_GE(line_mm, 7.0 / 80.0);
    EXPECT_GE(8.0 * line_mm, stage.speed_mm_s * stage.speed_mm_s / (2.0 * 500.0));
  }
}

TEST(LineTest, NeedsRoom) {
  const Result<std::string> text = line_test(read("[printer]\ntravel_x_mm = [0, 30]\n"));
  ASSERT_FALSE(text);
  EXPECT_THAT(to_string(text.error()), HasSubstr("printer.travel_x_mm leaves no 40 mm"));
}

}  // namespace
}  // namespace unflex::machine
