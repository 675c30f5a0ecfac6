#include "unflex/tune/pressure_tower.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <sstream>

#include "unflex/gcode/interpreter.hpp"
#include "unflex/gcode/line.hpp"

namespace unflex::tune {
namespace {

PressureTowerSettings settings(double accel_mm_s2 = 5000.0) {
  PressureTowerSettings result;
  result.accel_mm_s2 = accel_mm_s2;
  result.codes = {"G28\nM109 S210\n", "M104 S0\n", 110.0, 100.0};
  result.trial = next_trial(PressureKnowledge{});
  result.own_advance_s = 0.03;
  return result;
}

TEST(PressureTower, IsSlowAtBothEndsOfItsWallsAndFastBetween) {
  for (const double accel_mm_s2 : {800.0, 5000.0, 20000.0}) {
    const PressureTowerSettings all = settings(accel_mm_s2);
    const PressureWall wall = pressure_wall(all);
    EXPECT_GT(wall.fast_mm_s, 4.0 * wall.slow_mm_s);
    // Speed changes on the way, and leaves most of it even.
    EXPECT_GT(
        wall.fast_mm - (std::pow(wall.fast_mm_s, 2) - std::pow(wall.slow_mm_s, 2)) / accel_mm_s2,
        30.0);
    const Tower built = tower(all);
    std::istringstream stream(built.start + built.approach(3) + built.bands[2]);
    gcode::LineReader lines(stream, "tower");
    gcode::Interpreter interpreter(gcode::default_options(Firmware::klipper));
    double fast_mm = 0.0;
    double inner_mm = 0.0;
    double e_per_mm = 0.0;
    for (gcode::Line line; lines.next(line).value();) {
      for (const gcode::Segment& segment : interpreter.interpret(line).segments) {
        const double way_mm = std::hypot(segment.end_mm[gcode::X] - segment.start_mm[gcode::X],
                                         segment.end_mm[gcode::Y] - segment.start_mm[gcode::Y]);
        const double e_mm = segment.end_mm[gcode::E] - segment.start_mm[gcode::E];
        if (e_mm > 0.0) {
          // Every line is as thick as every other.
          e_per_mm = e_per_mm == 0.0 ? e_mm / way_mm : e_per_mm;
          EXPECT_NEAR(e_mm / way_mm, e_per_mm, 0.01 * e_per_mm);
          fast_mm += std::abs(segment.feed_mm_s - wall.fast_mm_s) < 0.1 ? way_mm : 0.0;
          inner_mm += std::abs(segment.feed_mm_s - 50.0) < 0.1 ? way_mm : 0.0;
        }
      }
    }
    EXPECT_NEAR(fast_mm, 4.0 * wall.fast_mm * static_cast<double>(all.layers_per_band), 0.1);
    EXPECT_GT(inner_mm, 0.0);
  }
}

TEST(PressureTower, MeltsNoMoreThanTheHotendCan) {
  PressureTowerSettings all = settings();
  all.max_flow_mm3_s = 6.0;
  EXPECT_NEAR(pressure_wall(all).fast_mm_s * 0.2 * 0.45, 6.0, 1e-9);
}

// A bowden of 0.4 s needs 0.4 · q̇ of speed at once: within 8 ms, 80 mm/s by 10 000 mm/s².
TEST(PressureTower, AcceleratesAsTheExtruderCanFollow) {
  PressureTowerSettings all = settings();
  all.trial = next_trial(PressureKnowledge{.sum_s = 0.404, .rounds = 1});
  const double accel_mm_s2 = followed_accel_mm_s2(all, 10000.0);
  // A line of 0.45 mm in layers of 0.2 mm.
  const double per_mm = (0.25 * 0.2 + 0.25 * 3.14159265 * 0.04) / (0.25 * 3.14159265 * 1.75 * 1.75);
  EXPECT_NEAR(0.4 * per_mm * accel_mm_s2, 80.0, 0.01);
  all.trial = next_trial(PressureKnowledge{.sum_s = 0.044, .rounds = 1});
  EXPECT_GT(followed_accel_mm_s2(all, 10000.0), 20000.0);
}

// The sliced tower tries the bands' advances by the firmware's own means, and the printer has its
// own back behind it.
TEST(PressureTower, SetsTheAdvanceOfEachBandAndThePrintersOwnBehind) {
  for (const auto& [firmware, first, own] :
       {std::tuple(Firmware::klipper, "SET_PRESSURE_ADVANCE ADVANCE=0.008000\n",
                   "SET_PRESSURE_ADVANCE ADVANCE=0.030000\n"),
        std::tuple(Firmware::marlin, "M900 K0.008000\n", "M900 K0.030000\n"),
        std::tuple(Firmware::rrf, "M572 D0 S0.008000\n", "M572 D0 S0.030000\n")}) {
    PressureTowerSettings all = settings();
    all.firmware = firmware;
    const Tower built = tower(all);
    EXPECT_TRUE(built.bands.front().starts_with(first)) << built.bands.front().substr(0, 60);
    EXPECT_TRUE(built.foot.starts_with(own)) << built.foot.substr(0, 60);
    std::set<std::string> heads;
    for (const std::string& band : built.bands) {
      heads.insert(band.substr(0, band.find('\n')));
    }
    EXPECT_EQ(heads.size(), built.bands.size());
  }
}

TEST(PressureTower, TellsWhatItIs) {
  const Tower built = tower(settings());
  EXPECT_TRUE(is_pressure_tower(built.start));
  const auto record = pressure_record_of(built.start, "t.gcode");
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_EQ(record->trial.bands, built.bands.size());
  EXPECT_EQ(record->codes.start, settings().codes.start);
  EXPECT_EQ(record->codes.end, settings().codes.end);
  EXPECT_EQ(record->codes.center_mm.x, 110.0);
  EXPECT_FALSE(is_pressure_tower(tower(TowerSettings{}).start));
  EXPECT_FALSE(pressure_record_of(tower(TowerSettings{}).start, "t.gcode"));
  EXPECT_FALSE(record_of(built.start, "t.gcode"));
}

}  // namespace
}  // namespace unflex::tune
