#include "unflex/tune/tower.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "unflex/gcode/interpreter.hpp"
#include "unflex/gcode/line.hpp"

namespace unflex::tune {
namespace {

TowerSettings settings(double accel_mm_s2 = 5000.0) {
  TowerSettings result;
  result.accel_mm_s2 = accel_mm_s2;
  result.codes = {"M104 S210\nG28\nM109 S210\n", "M104 S0\n", 110.0, 100.0};
  result.trials = {next_trial({}, accel_mm_s2),
                   next_trial({.freq_hz = 45.0, .freq_error = 0.02, .rounds = 2}, accel_mm_s2)};
  return result;
}

std::vector<gcode::Segment> segments_of(const std::string& text) {
  std::istringstream stream(text);
  gcode::LineReader lines(stream, "tower");
  gcode::Interpreter interpreter(gcode::default_options(Firmware::klipper));
  std::vector<gcode::Segment> segments;
  for (gcode::Line line; lines.next(line).value();) {
    const gcode::Event event = interpreter.interpret(line);
    EXPECT_TRUE(event.warnings.empty()) << line.text;
    segments.insert(segments.end(), event.segments.begin(), event.segments.end());
  }
  return segments;
}

std::string whole(const Tower& tower) {
  std::string text = tower.start + tower.base;
  for (const std::string& band : tower.bands) {
    text += band;
  }
  return text + tower.foot;
}

TEST(Tower, BeginsAndEndsEachBandAtOnePlace) {
  const Tower built = tower(settings());
  ASSERT_EQ(built.bands.size(), built.bottoms_mm.size());
  for (const std::size_t number : {1U, 2U, 7U}) {
    const auto segments =
        segments_of(built.start + built.approach(number) + built.bands[number - 1]);
    const gcode::Position& end = segments.back().end_mm;
    EXPECT_NEAR(end[gcode::X], built.begin_mm.x, 1e-3);
    EXPECT_NEAR(end[gcode::Y], built.begin_mm.y, 1e-3);
    EXPECT_NEAR(end[gcode::Z], built.bottoms_mm[number], 1e-9);
  }
}

// A priming line may lie on the way.
TEST(Tower, ComesFromTheStartCodeAboveTheBed) {
  const Tower built = tower(settings());
  bool moved = false;
  for (const gcode::Segment& segment : segments_of(built.start + "G1 Z0.2\n" + built.base)) {
    if (segment.moves_xy() && !moved) {
      moved = true;
      EXPECT_FALSE(segment.extruding());
      EXPECT_GE(segment.end_mm[gcode::Z], 1.0);
    }
  }
  EXPECT_TRUE(moved);
}

TEST(Tower, StandsAroundItsCenterAndIsAsLargeAsItSays) {
  const Tower built = tower(settings());
  double low_mm = 1e9;
  double high_mm = -1e9;
  for (const gcode::Segment& segment : segments_of(whole(built))) {
    if (segment.extruding()) {
      low_mm = std::min(low_mm, segment.end_mm[gcode::X]);
      high_mm = std::max(high_mm, segment.end_mm[gcode::X]);
    }
  }
  EXPECT_NEAR(0.5 * (low_mm + high_mm), 110.0, 1e-3);
  EXPECT_NEAR(high_mm - low_mm, built.side_mm + 2.0 * built.brim_mm, 1e-3);
}

TEST(Tower, LaysLinesOfEvenWidth) {
  constexpr double kLayer_mm = 0.2;
  constexpr double kWidth_mm = 0.45;
  const double area_mm2 = (kWidth_mm - kLayer_mm) * kLayer_mm + std::numbers::pi * 0.01;
  const double filament_mm2 = std::numbers::pi * 0.875 * 0.875;
  for (const gcode::Segment& segment : segments_of(whole(tower(settings())))) {
    if (segment.extruding()) {
      // E has five decimals, X and Y have four.
      EXPECT_NEAR(segment.delta(gcode::E) * filament_mm2, area_mm2 * segment.length_xy_mm(),
                  1.3e-5 + 1e-4 * area_mm2);
    }
  }
}

// Behind its waves the outer wall goes straight, at the speed that the wall tells.
TEST(Tower, HasStraightWallsBehindTheirWaves) {
  const TowerSettings wanted = settings();
  const Tower built = tower(wanted);
  const auto segments = segments_of(built.start + built.approach(1) + built.bands[0]);
  for (const Wall& wall : built.walls) {
    const gcode::Axis across = wall.shows_x ? gcode::X : gcode::Y;
    const gcode::Axis along = wall.shows_x ? gcode::Y : gcode::X;
    const Trial& trial = wanted.trials[wall.shows_x ? 0 : 1];
    const auto inward_mm = [&](const gcode::Position& place) {
      return (wall.at_mm - place[across]) * (wall.shows_x ? 1.0 : -1.0);
    };
    int straight = 0;
    double highest_mm = 0.0;
    for (const gcode::Segment& segment : segments) {
      // The first two layers have a groove, and the inner ring lies 0.45 mm further in.
      const bool is_outer = segment.extruding() && std::abs(inward_mm(segment.end_mm)) < 0.3 &&
                            segment.end_mm[gcode::Z] > built.bottoms_mm[0] + 0.5;
      if (is_outer && segment.start_mm[along] <= wall.from_mm + 1e-3 &&
          segment.end_mm[along] >= wall.to_mm - 1e-3) {
        ++straight;
        EXPECT_NEAR(segment.delta(across), 0.0, 1e-3);
        EXPECT_NEAR(segment.feed_mm_s, wall.speed_mm_s, 0.01);
      } else if (is_outer && segment.delta(along) > 0.0 && segment.end_mm[along] < wall.from_mm &&
                 segment.feed_mm_s > 40.0) {
        highest_mm = std::max(highest_mm, inward_mm(segment.end_mm));
      }
    }
    EXPECT_EQ(straight, static_cast<int>(wanted.layers_per_band) - 2);
    EXPECT_NEAR(highest_mm, trial.waves.height_mm(), 1e-3);
    EXPECT_GT(wall.to_mm - wall.from_mm, 5.0 * wall.speed_mm_s / trial.freq_hz(1));
  }
}

TEST(Tower, FitsSlowAndFastPrinters) {
  for (const double accel_mm_s2 : {300.0, 1000.0, 20000.0}) {
    const Tower built = tower(settings(accel_mm_s2));
    EXPECT_LT(built.side_mm, 130.0);
    EXPECT_GE(built.side_mm, 50.0);
  }
}

// Marlin keeps what M201 and M204 set until it is set again.
TEST(Tower, GoesBeyondThePrintersLimitsAndSetsThemAgain) {
  TowerSettings raised = settings(2500.0);
  raised.firmware = Firmware::marlin;
  EXPECT_EQ(tower(raised).start.find("M201"), std::string::npos);
  raised.own = AccelLimits{500.0, 400.0, 450.0, 300.0};
  const Tower built = tower(raised);
  EXPECT_TRUE(built.start.ends_with("M201 X2500 Y2500\nM204 P2500 T2500\n")) << built.start;
  const std::size_t back = built.foot.find("M201 X500 Y400\nM204 P450 T300\n");
  ASSERT_NE(back, std::string::npos) << built.foot;
  EXPECT_LT(back, built.foot.find(raised.codes.end));
  raised.firmware = Firmware::klipper;
  EXPECT_NE(tower(raised).foot.find("\nM204 S450\n"), std::string::npos);
}

TEST(Tower, TellsWhatItIs) {
  const TowerSettings wanted = settings();
  const Result<TowerRecord> record = record_of(whole(tower(wanted)), "tower.gcode");
  ASSERT_TRUE(record);
  EXPECT_EQ(record->codes.start, wanted.codes.start);
  EXPECT_EQ(record->codes.end, wanted.codes.end);
  EXPECT_DOUBLE_EQ(record->codes.center_mm.x, 110.0);
  EXPECT_DOUBLE_EQ(record->codes.center_mm.y, 100.0);
  EXPECT_EQ(record->trials[0].bands, wanted.trials[0].bands);
  EXPECT_EQ(record->trials[1].known.rounds, 2U);
}

TEST(Tower, IsNoOtherPrint) {
  for (const char* text : {"", "G28\nG1 X1\n", "; unflex tune: center=\nG28\n"}) {
    const Result<TowerRecord> record = record_of(text, "part.gcode");
    ASSERT_FALSE(record);
    EXPECT_EQ(record.error().kind, ErrorKind::input);
  }
}

}  // namespace
}  // namespace unflex::tune
