// The lines that set limits on each firmware, word by word.
#include "dialect.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "unflex/gcode/interpreter.hpp"

namespace unflex::emit {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

planner::FirmwareConfig config_of(Firmware firmware, bool classic_jerk = false) {
  planner::FirmwareConfig config;
  config.firmware = firmware;
  config.classic_jerk = classic_jerk;
  return config;
}

planner::Limits some_limits() {
  planner::Limits limits;
  limits.axis_max_accel_mm_s2 = {1250.0, 1000.0, 400.0, 4000.0};
  limits.axis_max_velocity_mm_s = {180.0, 175.5, 12.0, 80.0};
  limits.axis_jerk_mm_s = {8.0, 7.0, 2.0, 10.0};
  limits.print_accel_mm_s2 = 1500.0;
  limits.travel_accel_mm_s2 = 1800.0;
  limits.retract_accel_mm_s2 = 1250.0;
  limits.junction_deviation_mm = 0.02;
  limits.min_segment_time_s = 0.02;
  limits.min_movement_velocity_mm_s = 0.1;
  limits.jerk_policy = 1;
  return limits;
}

TEST(LimitLines, AreAllThatARunSetsWhereNothingIsKnown) {
  const planner::Limits limits = some_limits();
  EXPECT_THAT(
      limit_lines(config_of(Firmware::klipper), limits, unknown_to_run(Firmware::klipper, limits)),
      ElementsAre("SET_VELOCITY_LIMIT VELOCITY=300 ACCEL=5000 SQUARE_CORNER_VELOCITY=5 "
                  "MINIMUM_CRUISE_RATIO=0.5 ACCEL_TO_DECEL=2500"));
  EXPECT_THAT(
      limit_lines(config_of(Firmware::marlin), limits, unknown_to_run(Firmware::marlin, limits)),
      ElementsAre("M201 X1250 Y1000 E4000", "M203 X180 Y175.5", "M204 P1500 T1800",
                  "M205 J0.02 S0 T0 B20000"));
  EXPECT_THAT(limit_lines(config_of(Firmware::rrf), limits, unknown_to_run(Firmware::rrf, limits)),
              ElementsAre("M201 X1250 Y1000 E4000", "M203 X10800 Y10530 I6", "M204 P1500 T1800",
                          "M566 X480 Y420 E600 P1"));
}

TEST(LimitLines, TellMarlinWithClassicJerkTheJerks) {
  const planner::Limits limits = some_limits();
  EXPECT_EQ(limit_lines(config_of(Firmware::marlin, true), limits,
                        unknown_to_run(Firmware::marlin, limits))
                .back(),
            "M205 X8 Y7 E10 S0 T0 B20000");
}

// From RepRapFirmware 3.6 on, M566 sets the largest jerk and the jerk of prints, M205 only the
// latter.
TEST(LimitLines, SetBothJerksOfRepRapFirmware) {
  planner::FirmwareConfig config = config_of(Firmware::rrf);
  config.has_print_jerk = true;
  planner::Limits file = some_limits();
  file.axis_max_jerk_mm_s = {10.0, 7.0, 2.0, 10.0};
  planner::Limits run = file;
  for (const gcode::Axis axis : {gcode::X, gcode::Y, gcode::E}) {
    run.axis_jerk_mm_s[axis] = run.axis_max_jerk_mm_s[axis] = 1000.0;
  }
  EXPECT_THAT(limit_lines(config, run, file), ElementsAre("M566 X60000 Y60000 E60000"));
  EXPECT_THAT(limit_lines(config, file, run), ElementsAre("M566 X600 Y420 E600", "M205 X8"));
  EXPECT_THAT(limit_lines(config, file, file), IsEmpty());
  planner::Limits lower = file;
  lower.axis_jerk_mm_s[gcode::Y] = 5.0;
  EXPECT_THAT(limit_lines(config, lower, file), ElementsAre("M205 Y5"));
  EXPECT_EQ(limit_lines(config, file, unknown_to_run(Firmware::rrf, file)).back(), "M205 X8");
  // When the firmware reads these lines, the wanted limits are in force.
  gcode::InterpreterOptions options = gcode::default_options(Firmware::rrf);
  options.has_print_jerk = true;
  for (const planner::Limits& wanted : {file, lower}) {
    gcode::Interpreter printer(options);
    planner::Limits limits = run;
    for (const std::string& line : limit_lines(config, wanted, run)) {
      planner::apply(*printer.interpret({line, 1}).limits, limits);
    }
    EXPECT_EQ(limits, wanted);
  }
}

TEST(LimitLines, AreOnlyWhatDiffers) {
  const planner::Limits current = some_limits();
  planner::Limits wanted = current;
  for (const Firmware firmware : {Firmware::klipper, Firmware::marlin, Firmware::rrf}) {
    EXPECT_THAT(limit_lines(config_of(firmware), wanted, current), IsEmpty());
  }
  wanted.axis_max_accel_mm_s2[gcode::Y] = 1100.0;
  wanted.axis_jerk_mm_s[gcode::E] = 5.0;
  EXPECT_THAT(limit_lines(config_of(Firmware::rrf), wanted, current),
              ElementsAre("M201 Y1100", "M566 E300"));
  EXPECT_THAT(limit_lines(config_of(Firmware::marlin), wanted, current), ElementsAre("M201 Y1100"));
}

// An interpreter of the same firmware must understand the lines as they are meant.
TEST(LimitLines, AreReadBackAsTheyWereMeant) {
  for (const Firmware firmware : {Firmware::marlin, Firmware::rrf}) {
    const planner::Limits wanted = some_limits();
    planner::Limits read;
    gcode::Interpreter printer(gcode::default_options(firmware));
    for (const std::string& text :
         limit_lines(config_of(firmware), wanted, unknown_to_run(firmware, planner::Limits{}))) {
      const gcode::Event event = printer.interpret({text + "\n", 1});
      EXPECT_EQ(event.kind, gcode::EventKind::limits) << text;
      planner::apply(*event.limits, read);
    }
    for (std::size_t axis = 0; axis < 4; ++axis) {
      EXPECT_DOUBLE_EQ(read.axis_max_accel_mm_s2[axis], wanted.axis_max_accel_mm_s2[axis]);
      EXPECT_DOUBLE_EQ(read.axis_max_velocity_mm_s[axis], wanted.axis_max_velocity_mm_s[axis]);
    }
    EXPECT_DOUBLE_EQ(read.print_accel_mm_s2, wanted.print_accel_mm_s2);
    EXPECT_DOUBLE_EQ(read.travel_accel_mm_s2, wanted.travel_accel_mm_s2);
  }
}

TEST(LimitsInRun, LeaveZAndRetractionAsTheFileHasThem) {
  planner::Limits raised;
  raised.axis_max_accel_mm_s2 = {1e6, 1e6, 1e6, 1e6};
  raised.retract_accel_mm_s2 = 1e6;
  const planner::Limits file = some_limits();
  const planner::Limits in_run = limits_in_run(Firmware::marlin, file, raised);
  EXPECT_EQ(in_run.axis_max_accel_mm_s2, (std::array{1e6, 1e6, 400.0, 1e6}));
  EXPECT_EQ(in_run.axis_max_velocity_mm_s[gcode::Z], 12.0);
  EXPECT_EQ(in_run.retract_accel_mm_s2, 1250.0);
}

TEST(ShaperLines, SwitchOffAndBackOn) {
  gcode::Shaper on;
  on.freq_hz.x = 40.0;
  on.freq_hz.y = 42.5;
  EXPECT_THAT(shaper_lines(Firmware::klipper, {}, on),
              ElementsAre("SET_INPUT_SHAPER SHAPER_FREQ_X=0 SHAPER_FREQ_Y=0"));
  EXPECT_THAT(shaper_lines(Firmware::marlin, {}, on), ElementsAre("M593 X F0", "M593 Y F0"));
  EXPECT_THAT(shaper_lines(Firmware::marlin, on, {}), ElementsAre("M593 X F40", "M593 Y F42.5"));
  EXPECT_THAT(shaper_lines(Firmware::rrf, {}, on), ElementsAre("M593 P\"none\""));
  on.settings.type.x = "mzv";
  on.settings.damping_ratio.x = 0.1;
  EXPECT_THAT(shaper_lines(Firmware::rrf, on, {}), ElementsAre("M593 P\"mzv\" F40 S0.1"));
  EXPECT_THAT(shaper_lines(Firmware::rrf, on, on), IsEmpty());
}

TEST(ShaperLines, SwitchOffWhatIsNotKnownAndCannotSwitchItOn) {
  gcode::Shaper unknown;
  unknown.unknown.x = unknown.unknown.y = true;
  EXPECT_THAT(shaper_lines(Firmware::klipper, {}, unknown),
              ElementsAre("SET_INPUT_SHAPER SHAPER_FREQ_X=0 SHAPER_FREQ_Y=0"));
  EXPECT_THAT(shaper_lines(Firmware::klipper, unknown, {}), IsEmpty());
  EXPECT_EQ(unknown_shaper_lines(Firmware::klipper, unknown, {}),
            "SET_INPUT_SHAPER SHAPER_FREQ_X=... SHAPER_FREQ_Y=...");
  EXPECT_EQ(unknown_shaper_lines(Firmware::marlin, unknown, {}), "M593 X F... and M593 Y F...");
  EXPECT_EQ(unknown_shaper_lines(Firmware::rrf, unknown, {}), "M593 P\"...\" F...");
  EXPECT_THAT(shaper_lines(Firmware::marlin, {}, unknown), ElementsAre("M593 X F0", "M593 Y F0"));
  EXPECT_THAT(shaper_lines(Firmware::marlin, unknown, {}), IsEmpty());
  EXPECT_THAT(shaper_lines(Firmware::rrf, {}, unknown), ElementsAre("M593 P\"none\""));
  EXPECT_THAT(shaper_lines(Firmware::rrf, unknown, {}), IsEmpty());
  EXPECT_EQ(unknown_shaper_lines(Firmware::klipper, unknown, unknown), "");
  unknown.unknown.y = false;
  unknown.freq_hz.y = 40.0;
  EXPECT_THAT(shaper_lines(Firmware::klipper, unknown, {}),
              ElementsAre("SET_INPUT_SHAPER SHAPER_FREQ_Y=40"));
  EXPECT_EQ(unknown_shaper_lines(Firmware::klipper, unknown, {}),
            "SET_INPUT_SHAPER SHAPER_FREQ_X=...");
}

}  // namespace
}  // namespace unflex::emit
