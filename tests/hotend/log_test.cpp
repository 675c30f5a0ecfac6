#include "unflex/hotend/log.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

namespace unflex::hotend {
namespace {

std::string error_of(std::string_view text, const LogOptions& options = {}) {
  const Result<Log> log = parse_log(text, "log", options);
  return log ? "none" : to_string(log.error());
}

TEST(Table, HasColumnsInAnyOrder) {
  const Result<Log> log = parse_log(
      "# Power;target;TIME_S;Temp\r\n"
      "255;200;0.5;25.25\r\n"
      "\r\n"
      "# a remark\r\n"
      "51;200;1.5e0;26\r\n",
      "log");
  ASSERT_TRUE(log);
  ASSERT_EQ(log->samples.size(), 2U);
  EXPECT_EQ(log->hold, Hold::to_next);
  EXPECT_EQ(log->samples[0].time_s, 0.5);
  EXPECT_EQ(log->samples[0].temperature_c, 25.25);
  EXPECT_EQ(log->samples[0].power, 255.0);
  EXPECT_EQ(log->samples[1].time_s, 1.5);
  EXPECT_EQ(log->samples[1].power, 51.0);
}

TEST(Table, HasPowerOfTheScaleThatIsGiven) {
  const Result<Log> log =
      parse_log("time,temperature,power\n0,25,0.2\n", "log", {.full_power = 1.0});
  ASSERT_TRUE(log);
  EXPECT_DOUBLE_EQ(log->samples[0].power, 51.0);
  EXPECT_EQ(error_of("time,temperature,power\n0,25,256\n"),
            "log:2: has a power of 256, which is not within 0 and 255; say what full power is in "
            "this log");
  EXPECT_EQ(error_of("time,temperature,power\n", {.full_power = 0.0}),
            "full power must be above 0; give what it is in the log");
}

TEST(Table, IsRefusedWithItsLine) {
  EXPECT_EQ(error_of(""),
            "log: has no rows; give a table of time,temperature,power, klippy.log or a serial log");
  EXPECT_EQ(error_of("time_ms,temp,power\n"),
            "log:1: names no column 'time'; begin the table with time,temperature,power, in s, °C "
            "and counts, or give klippy.log or a serial log");
  EXPECT_EQ(error_of("time,t,temp,power\n"), "log:1: names time twice; leave one column out");
  EXPECT_EQ(error_of("time,temp,power\n0,25,0\n1,hot,0\n"),
            "log:3: has no number for temperature; give one in each row");
  EXPECT_EQ(error_of("time,temp,power\n0,25\n"),
            "log:2: has no number for power; give one in each row");
  EXPECT_EQ(error_of("time,temp,power\n0,25,nan\n"),
            "log:2: has no number for power; give one in each row");
  EXPECT_EQ(error_of("time,temp,power\n1,25,0\n1,25,0\n"),
            "log:3: is not later than the row before; sort the rows by time and leave doubles out");
}

std::string stats(double time_s, double temperature_c, double power) {
  return fmt::format(
      "Stats {:.1f}: gcodein=0  mcu: mcu_awake=0.002 freq=15934599 heater_bed: target=60 temp=60.1 "
      "pwm=0.127 print_time=33.069 buffer_time=3.718 my_extruder: target=1 temp=1.0 pwm=1.000 "
      "extruder: target=200 temp={:.1f} pwm={:.3f} extruder1: target=0 temp=30.0 pwm=0.500\n",
      time_s, temperature_c, power);
}

TEST(KlippyLog, HasTheHeaterOfItsStats) {
  const std::string text = "Loaded MCU 'mcu' 100 commands\n" + stats(100.5, 25.1, 0.0) +
                           "webhooks: connected\n" + stats(101.5, 25.3, 0.4);
  const Result<Log> log = parse_log(text, "log");
  ASSERT_TRUE(log);
  ASSERT_EQ(log->samples.size(), 2U);
  EXPECT_EQ(log->hold, Hold::to_nearer);
  EXPECT_EQ(log->samples[0].time_s, 0.0);
  EXPECT_EQ(log->samples[1].time_s, 1.0);
  EXPECT_EQ(log->samples[1].temperature_c, 25.3);
  EXPECT_DOUBLE_EQ(log->samples[1].power, 102.0);
  const Result<Log> other = parse_log(text, "log", {.full_power = {}, .heater = "extruder1"});
  ASSERT_TRUE(other);
  EXPECT_EQ(other->samples[0].temperature_c, 30.0);
  EXPECT_DOUBLE_EQ(other->samples[0].power, 127.5);
}

TEST(KlippyLog, IsRefusedWithItsLine) {
  EXPECT_EQ(error_of("Stats 1.0: gcodein=0\n"),
            "log: has no Stats line with 'extruder: target='; name the heater as its section in "
            "printer.cfg is named");
  const std::string broken = "Stats 2.0: extruder: target=200 temp=abc pwm=0.5\n";
  EXPECT_EQ(error_of(stats(1.0, 25.0, 0.0) + broken),
            "log:2: has no time, temp= or pwm= of 'extruder'; give klippy.log as Klipper wrote it");
  // A log that is being written ends anywhere.
  EXPECT_EQ(error_of(stats(1.0, 25.0, 0.0) + "Stats 2.0: extruder: target=200 te"), "none");
  EXPECT_EQ(error_of(stats(1.0, 25.0, 1.5)),
            "log:1: has a power below 0 or above full power; say what full power is in this log");
}

TEST(KlippyLog, GivesTheStretchThatVariesMost) {
  std::string text;
  for (int k = 0; k < 50; ++k) {
    text += stats(1000.0 + k, 60.0 - 0.1 * k, 0.0);
  }
  for (int k = 0; k < 60; ++k) {  // behind a gap
    text += stats(1200.0 + k, 25.0 + 2.0 * k, 1.0);
  }
  for (int k = 0; k < 50; ++k) {  // after a restart
    text += stats(10.0 + k, 80.0, 0.1);
  }
  const Result<Log> log = parse_log(text, "log");
  ASSERT_TRUE(log);
  ASSERT_EQ(log->samples.size(), 60U);
  EXPECT_EQ(log->samples.front().temperature_c, 25.0);
  EXPECT_EQ(log->samples.back().time_s, 59.0);
}

TEST(KlippyLog, GivesAnHourAtMost) {
  std::string text;
  for (int k = 0; k < 9000; ++k) {
    text += stats(k, k < 5000 ? 30.0 : std::min(200.0, 30.0 + (k - 5000)), 0.5);
  }
  const Result<Log> log = parse_log(text, "log");
  ASSERT_TRUE(log);
  EXPECT_NEAR(log->samples.back().time_s, 3600.0, 1.0);
  EXPECT_EQ(log->samples.front().temperature_c, 30.0);
  EXPECT_EQ(log->samples.back().temperature_c, 200.0);
}

TEST(SerialLog, HasTimeTemperatureAndPower) {
  const std::string text =
      "2023-12-31 23:59:58,000 - Send: M105\n"
      "2023-12-31 23:59:58,500 - Recv: ok T:115.01 /180.00 B:27.27 /0.00 @:127 B@:0\n"
      "2023-12-31 23:59:59,000 - Recv: T:116 E:0 W:?\n"
      "2024-01-01 00:00:00,600 - Recv:  T:118.95 /180.00 B:27.27 /0.00 T0:118.95 /180 @:63 B@:5\n";
  const Result<Log> log = parse_log(text, "log");
  ASSERT_TRUE(log);
  ASSERT_EQ(log->samples.size(), 2U);
  EXPECT_EQ(log->hold, Hold::to_nearer);
  EXPECT_NEAR(log->samples[1].time_s, 2.1, 1e-6);
  EXPECT_EQ(log->samples[0].temperature_c, 115.01);
  EXPECT_EQ(log->samples[0].power, 255.0);
  EXPECT_DOUBLE_EQ(log->samples[1].power, 63.0 / 127.0 * 255.0);
}

TEST(SerialLog, KnowsOtherHeaters) {
  const Result<Log> log =
      parse_log("2024-01-01 12:00:00,123 - Recv: ok T:20 /0 T0:20 /0 T1:90 /99 @:0 @0:0 @1:127\n",
                "log", {.full_power = {}, .heater = "extruder1"});
  ASSERT_TRUE(log);
  EXPECT_EQ(log->samples[0].temperature_c, 90.0);
  EXPECT_EQ(log->samples[0].power, 255.0);
}

TEST(SerialLog, IsRefusedWithoutPower) {
  EXPECT_EQ(error_of("2024-01-01 12:00:00,123 - Send: M105\n"
                     "2024-01-01 12:00:00,123 - Recv: ok T:20 /0\n"),
            "log:2: has a temperature but no power '@:', nor has any other line; log with a "
            "firmware that reports it, or give a table");
  EXPECT_EQ(error_of("2024-01-01 12:00:00,123 - Recv: ok T:20 /0 @:200\n"),
            "log:1: has a power below 0 or above full power; say what full power is in this log");
}

}  // namespace
}  // namespace unflex::hotend
