#include "unflex/hotend/along_print.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "hotend/reference.hpp"

namespace unflex::hotend {
namespace {

constexpr double kBand_c = 5.0;

Loop loop() {
  return {.plant = kReference, .control = {.gains = *gains(Rule::simc_pid, kReference)}};
}

// A print that lays filament all the time, a line in each step.
Course steady(double duration_s) {
  Course course;
  const auto count = static_cast<std::size_t>(duration_s / Course::kStep_s);
  for (std::size_t k = 0; k < count; ++k) {
    course.steps.push_back({.extruding_s = static_cast<float>(Course::kStep_s),
                            .volume_mm3 = 1.0F,
                            .first_line = static_cast<std::uint32_t>(k + 1)});
  }
  return course;
}

Command change(double time_s, double target_c, Wait wait = Wait::none) {
  return {.line = static_cast<std::size_t>(time_s / Course::kStep_s) + 1,
          .time_s = time_s,
          .target_c = target_c,
          .wait = wait,
          .free_from_s = 0.0,
          .text = "M104"};
}

struct Row {
  double from_c = 0.0;
  double to_c = 0.0;
  double lead_to_target_s = 0.0;
  double lead_to_band_s = 0.0;
  double out_without_s = 0.0;
  double out_with_s = 0.0;
  double cold_without_s = 0.0;
  double cold_with_s = 0.0;
};

constexpr Row kRows[] = {
    {200.0, 220.0, 24.79, 20.1, 21.3, 9.5, 21.3, 1.3},
    {220.0, 200.0, 38.85, 30.4, 31.5, 16.2, 0.0, 14.8},
    {215.0, 230.0, 20.71, 15.8, 17.1, 5.0, 17.1, 1.6},
};

TEST(Ahead, IsThatOfTheTable) {
  constexpr double kRounded_s = 0.05;
  constexpr double kSteps_s = 0.3;  // of the course
  // A controller heeds a change when it samples next, and the place may be two steps early.
  constexpr double kPlaced_s = kUsualSample_s + 2.0 * Course::kStep_s;
  for (const Row& row : kRows) {
    SCOPED_TRACE(row.to_c);
    const double band_c = row.to_c > row.from_c ? kBand_c : -kBand_c;
    EXPECT_NEAR(*lead_s(kReference, row.from_c, row.to_c, row.to_c), row.lead_to_target_s,
                kRounded_s);
    EXPECT_NEAR(*lead_s(kReference, row.from_c, row.to_c, row.to_c - band_c), row.lead_to_band_s,
                kRounded_s);
    const Course course = steady(400.0);
    const std::vector<Command> commands = {change(0.0, row.from_c), change(200.0, row.to_c)};
    const std::vector<Target> wanted = targets(commands);
    const PrintResponse without = print_response(loop(), course, commands, wanted, kBand_c);
    EXPECT_NEAR(without.out_of_band_s(), row.out_without_s, kSteps_s);
    EXPECT_NEAR(without.colder_s, row.cold_without_s, kSteps_s);
    const std::vector<Ahead> ahead =
        choose_ahead(loop(), course, commands, kBand_c, AheadWhen::both);
    ASSERT_EQ(ahead.size(), 1U);
    const PrintResponse with =
        print_response(loop(), course, with_ahead(commands, ahead), wanted, kBand_c);
    EXPECT_NEAR(with.out_of_band_s(), row.out_with_s, kPlaced_s);
    EXPECT_NEAR(with.colder_s, row.cold_with_s, kPlaced_s);
  }
}

std::vector<Ahead> chosen(const Course& course, const std::vector<Command>& commands,
                          AheadWhen when = AheadWhen::heating) {
  return choose_ahead(loop(), course, commands, kBand_c, when);
}

PrintResponse print_response(const Course& course, const std::vector<Command>& commands) {
  return print_response(loop(), course, commands, targets(commands), kBand_c);
}

TEST(Ahead, StandsBeforeALineThatBeginsInTime) {
  Course course = steady(400.0);
  // A long move: no line begins between 170 and 190 s, and the change is wanted at 179.9 s.
  for (std::size_t k = 1700; k < 1900; ++k) {
    course.steps[k].first_line = 0;
  }
  const std::vector<Ahead> ahead = chosen(course, {change(0.0, 200.0), change(200.0, 220.0)});
  ASSERT_EQ(ahead.size(), 1U);
  EXPECT_EQ(ahead[0].command, 1U);
  EXPECT_EQ(ahead[0].before_line, 1700U);
  EXPECT_DOUBLE_EQ(ahead[0].time_s, 169.9);
  EXPECT_EQ(ahead[0].from_c, 200.0);
  EXPECT_EQ(ahead[0].to_c, 220.0);
}

TEST(Ahead, LeavesWhatCannotStandEarlier) {
  const Course course = steady(400.0);
  const auto none = [&](const std::vector<Command>& commands) {
    return chosen(course, commands).empty();
  };
  Command blocked = change(200.0, 220.0);
  blocked.free_from_s = 185.0;
  EXPECT_TRUE(none({change(0.0, 200.0), blocked}));
  blocked.free_from_s = 175.0;
  EXPECT_FALSE(none({change(0.0, 200.0), blocked}));
  Command fixed = change(200.0, 220.0);
  fixed.text.clear();
  EXPECT_TRUE(none({change(0.0, 200.0), fixed}));
  EXPECT_TRUE(none({change(0.0, 200.0), change(10.0, 220.0)})) << "before the print";
  EXPECT_TRUE(none({change(0.0, 200.0), change(200.0, 204.0)})) << "within the band";
  EXPECT_TRUE(none({change(0.0, 200.0), change(200.0, 180.0)})) << "cooling";
  EXPECT_TRUE(none({change(0.0, 200.0), change(200.0, 0.0)})) << "off";
  EXPECT_TRUE(none({change(0.0, 0.0), change(200.0, 220.0)})) << "from an unknown temperature";
  EXPECT_TRUE(none({change(0.0, 200.0), change(200.0, 600.0)})) << "hotter than it can be";
}

TEST(Ahead, WaitsLessAndIsNeverHotBefore) {
  const Course course = steady(400.0);
  for (const Wait wait : {Wait::heating, Wait::settled}) {
    const std::vector<Command> commands = {change(0.0, 200.0), change(200.0, 220.0, wait)};
    const std::vector<Ahead> ahead = chosen(course, commands);
    ASSERT_EQ(ahead.size(), 1U);
    const std::vector<Command> early = with_ahead(commands, ahead);
    ASSERT_EQ(early.size(), 3U) << "the waiting stays in its place";
    EXPECT_EQ(early[1].wait, Wait::none);
    EXPECT_EQ(early[2].wait, wait);
    EXPECT_EQ(early[2].time_s, 200.0);
    const PrintResponse before = print_response(course, commands);
    const PrintResponse after = print_response(loop(), course, early, targets(commands), kBand_c);
    EXPECT_EQ(before.out_of_band_s(), 0.0);
    EXPECT_EQ(after.out_of_band_s(), 0.0);
    EXPECT_NEAR(before.waiting_s, 24.0, 4.0);
    EXPECT_LT(after.waiting_s, before.waiting_s - 8.0);
  }
}

TEST(Ahead, NeverLeavesMoreOutOfTheBand) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> pause_s(4.0, 90.0);
  std::uniform_int_distribution<int> tens(19, 25);
  std::size_t moved = 0;
  std::size_t changes = 0;
  for (int print = 0; print < 40; ++print) {
    const Course course = steady(900.0);
    std::vector<Command> commands = {change(0.0, 210.0)};
    for (double at_s = pause_s(random); at_s < 880.0; at_s += pause_s(random)) {
      commands.push_back(change(at_s, 10.0 * tens(random)));
      commands.back().free_from_s = commands[commands.size() - 2].time_s;
    }
    for (const AheadWhen when : {AheadWhen::heating, AheadWhen::both}) {
      const std::vector<Ahead> ahead = chosen(course, commands, when);
      const std::vector<Command> early = with_ahead(commands, ahead);
      const PrintResponse after = print_response(loop(), course, early, targets(commands), kBand_c);
      EXPECT_LE(after.out_of_band_s(), print_response(course, commands).out_of_band_s() + 1e-3);
      ASSERT_EQ(early.size(), commands.size());
      for (std::size_t i = 0; i < early.size(); ++i) {
        EXPECT_EQ(early[i].target_c, commands[i].target_c) << "none has passed another one";
      }
      moved += ahead.size();
      changes += commands.size() - 1;
    }
  }
  EXPECT_GT(moved, changes / 10);
}

TEST(AlongPrint, BeginsWarmWhereFilamentFirstFlows) {
  Course course = steady(100.0);
  for (std::size_t k = 0; k < 300; ++k) {
    course.steps[k].extruding_s = 0.0F;
  }
  const PrintResponse warm = print_response(course, {change(0.0, 150.0), change(20.0, 210.0)});
  EXPECT_DOUBLE_EQ(warm.known_from_s.value_or(-1.0), 30.0);
  EXPECT_TRUE(std::isnan(warm.temperature_c[299]));
  EXPECT_NEAR(warm.temperature_c[300], 210.0, 1e-3);
  EXPECT_NEAR(warm.worst_c, 0.0, 1e-3);
  const PrintResponse late = print_response(course, {change(50.0, 210.0)});
  EXPECT_DOUBLE_EQ(late.known_from_s.value_or(-1.0), 50.0);
  EXPECT_FALSE(print_response(course, {}).known_from_s.has_value());
  EXPECT_EQ(print_response(course, {}).temperature_c.size(), 0U);
}

TEST(AlongPrint, CoolsByTheTimeConstantWithoutPower) {
  const PrintResponse off = print_response(steady(600.0), {change(0.0, 225.0), change(100.0, 0.0)});
  const double elapsed_s = 600.0 - 100.0 - kReference.dead_time_s;
  // Behind the sensor's lag, which lets it come later by that much.
  const double expected_c = 200.0 * std::exp(-(elapsed_s - kReference.sensor_lag_s) / 300.0);
  EXPECT_NEAR(off.temperature_c.back() - kReference.ambient_c, expected_c, 0.5);
  EXPECT_EQ(off.out_of_band_s(), 0.0) << "nothing is wanted any more";
}

TEST(AlongPrint, SagsUnderTheLoadOfFilament) {
  Loop heated = loop();
  heated.heater_w = 40.0;
  const std::vector<Command> commands = {change(0.0, 220.0)};
  const PrintResponse loaded =
      print_response(heated, steady(600.0), commands, targets(commands), kBand_c);
  const double load =
      load_in_counts(kReference, melting_power_w(10.0, 220.0 - kReference.ambient_c), 40.0);
  const Response expected = load_response(kReference, heated.control, 220.0, load);
  EXPECT_NEAR(std::abs(loaded.worst_c), expected.worst_c, 0.05);
  EXPECT_LT(loaded.worst_c, 0.0);
  EXPECT_GT(loaded.worst_line, 1U);
}

}  // namespace
}  // namespace unflex::hotend
