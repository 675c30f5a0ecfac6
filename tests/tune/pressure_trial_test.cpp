#include "unflex/tune/pressure_trial.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace unflex::tune {
namespace {

PressureKnowledge known(double sum_s, double sum_error_s, std::size_t rounds) {
  return {.sum_s = sum_s, .sum_error_s = sum_error_s, .rounds = rounds};
}

TEST(PressureTrial, TriesDirectExtrudersAndBowdensIfNothingIsKnown) {
  const PressureTrial trial = next_trial(PressureKnowledge{});
  EXPECT_EQ(trial.parameter, PressureParameter::sum);
  EXPECT_LE(trial.advance_s(1), 0.02);
  EXPECT_GE(trial.advance_s(trial.bands), 0.8);
  EXPECT_LT(trial.step, 1.13);
}

TEST(PressureTrial, TakesTurnsBetweenTheSumAndTheDeadTime) {
  EXPECT_EQ(next_trial(known(0.05, 0.01, 1)).parameter, PressureParameter::sum);
  EXPECT_EQ(next_trial(known(0.05, 0.001, 2)).parameter, PressureParameter::dead_time);
  EXPECT_EQ(next_trial(known(0.05, 0.001, 3)).parameter, PressureParameter::sum);
  EXPECT_EQ(next_trial(known(0.05, 0.001, 4)).parameter, PressureParameter::dead_time);
}

TEST(PressureTrial, CoversWhatTheValueMayBeAndKeepsTheOther) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> sum_s(0.015, 0.8);
  std::uniform_real_distribution<double> share(0.0, 0.4);
  for (int i = 0; i < 200; ++i) {
    PressureKnowledge before = known(sum_s(random), 0.0, 1);
    before.sum_error_s = share(random) * before.sum_s;
    const PressureTrial sums = next_trial(before);
    EXPECT_LE(sums.value_s(1),
              std::max(before.sum_s - before.sum_error_s, before.dead_time_s + 0.001) + 1e-12);
    EXPECT_GE(sums.value_s(sums.bands), before.sum_s + before.sum_error_s - 1e-12);
    before.rounds = 2;
    const PressureTrial dead_times = next_trial(before);
    EXPECT_LE(dead_times.bands, 41U);
    EXPECT_LT(dead_times.dead_time_s(1), 0.0);
    EXPECT_GE(dead_times.dead_time_s(dead_times.bands),
              std::min(0.01, before.sum_s - 0.001) - 1e-9);
    for (std::size_t band = 1; band <= sums.bands; ++band) {
      EXPECT_EQ(sums.dead_time_s(band), before.dead_time_s);
      EXPECT_GE(sums.advance_s(band), 0.001);
    }
    for (std::size_t band = 1; band <= dead_times.bands; ++band) {
      EXPECT_NEAR(dead_times.advance_s(band) + dead_times.dead_time_s(band), before.sum_s, 1e-6);
      EXPECT_GE(dead_times.advance_s(band), 0.00099);
    }
  }
}

TEST(PressureTrial, IsReadAsTheMiddleOfTheZone) {
  const PressureTrial trial = next_trial(known(0.05, 0.01, 1));
  const auto next = read(trial, {18, 26});
  ASSERT_TRUE(next);
  EXPECT_NEAR(next->sum_s, trial.value_s(22), 1e-12);
  EXPECT_EQ(next->rounds, 2U);
  EXPECT_LT(next->sum_error_s, trial.known.sum_error_s);
  EXPECT_EQ(next->dead_time_s, trial.known.dead_time_s);
}

TEST(PressureTrial, TriesAgainAroundAnEndThatIsEven) {
  const PressureTrial trial = next_trial(known(0.05, 0.01, 1));
  const auto next = read(trial, {38, 41});
  ASSERT_TRUE(next);
  EXPECT_EQ(next->rounds, 1U);
  EXPECT_GT(next_trial(*next).value_s(41), trial.value_s(41));
}

TEST(PressureTrial, RefusesBandsThatItDoesNotHave) {
  const PressureTrial trial = next_trial(PressureKnowledge{});
  for (const Zone& zone : {Zone{0, 3}, Zone{5, 4}, Zone{1, trial.bands + 1}}) {
    EXPECT_FALSE(read(trial, zone));
  }
}

TEST(PressureTrial, ComesBackFromItsComment) {
  for (const PressureKnowledge& before :
       {PressureKnowledge{}, known(0.05, 0.01, 1), known(0.4, 0.001, 2), known(0.4, 0.001, 4)}) {
    const PressureTrial trial = next_trial(before);
    const auto back = pressure_trial(to_comment(trial), {"t.gcode", 2});
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_EQ(back->parameter, trial.parameter);
    EXPECT_EQ(back->bands, trial.bands);
    EXPECT_EQ(back->known.rounds, before.rounds);
    for (const std::size_t band : {std::size_t{1}, trial.bands}) {
      EXPECT_NEAR(back->advance_s(band), trial.advance_s(band),
                  2e-5 * trial.advance_s(band) + 1e-6);
      EXPECT_NEAR(back->dead_time_s(band), trial.dead_time_s(band), 1e-5);
    }
  }
  const std::string good = to_comment(next_trial(known(0.05, 0.01, 1)));
  for (const std::string& bad :
       {std::string(kPressureMark), good.substr(0, good.size() - 10),
        std::string(kPressureMark) + " parameter=flow" + good.substr(good.find(" bands"))}) {
    const auto back = pressure_trial(bad, {"t.gcode", 2});
    ASSERT_FALSE(back) << bad;
    EXPECT_EQ(back.error().place.line, 2U);
  }
}

}  // namespace
}  // namespace unflex::tune
