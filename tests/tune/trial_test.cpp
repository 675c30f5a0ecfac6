#include "unflex/tune/trial.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace unflex::tune {
namespace {

constexpr double kAccel_mm_s2 = 5000.0;

Knowledge known(double freq_hz, double freq_error, std::size_t rounds) {
  return {.freq_hz = freq_hz, .freq_error = freq_error, .rounds = rounds};
}

TEST(Trial, TriesAllFrequenciesOfPrintersIfNothingIsKnown) {
  const Trial trial = next_trial({}, kAccel_mm_s2);
  EXPECT_EQ(trial.parameter, Parameter::freq_hz);
  EXPECT_LE(trial.value(1), 25.0);
  EXPECT_GE(trial.value(trial.bands), 90.0);
  EXPECT_LE(trial.step, 1.05);
  // A wave that lasts two periods of the axis leaves it at rest.
  EXPECT_GT(2.0 * trial.waves.freq_hz, 1.2 * trial.value(trial.bands));
}

// A stock Ender-3 has 500 mm/s².
TEST(Trial, NeedsAnAccelerationThatMakesWavesSeen) {
  const double needed = needed_accel_mm_s2(next_trial({}, 500.0), 500.0);
  EXPECT_GT(needed, 600.0);
  EXPECT_LT(needed, 1000.0);
  EXPECT_EQ(needed_accel_mm_s2(next_trial({}, 1.01 * needed), 1.01 * needed), 0.0);
  EXPECT_EQ(needed_accel_mm_s2(next_trial({}, kAccel_mm_s2), kAccel_mm_s2), 0.0);
}

TEST(Trial, TakesTurnsBetweenFrequencyAndDamping) {
  EXPECT_EQ(next_trial(known(45.0, 0.1, 0), kAccel_mm_s2).parameter, Parameter::freq_hz);
  EXPECT_EQ(next_trial(known(45.0, 0.1, 1), kAccel_mm_s2).parameter, Parameter::damping_ratio);
  EXPECT_EQ(next_trial(known(45.0, 0.1, 2), kAccel_mm_s2).parameter, Parameter::freq_hz);
}

TEST(Trial, CoversWhatTheValueMayBe) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> freq_hz(20.0, 100.0);
  std::uniform_real_distribution<double> error(0.002, 0.2);
  std::uniform_real_distribution<double> accel_mm_s2(500.0, 20000.0);
  for (int i = 0; i < 200; ++i) {
    const Knowledge before = known(freq_hz(random), error(random), 0);
    const double print_mm_s2 = accel_mm_s2(random);
    const Trial trial = next_trial(before, print_mm_s2);
    EXPECT_LT(trial.value(1), before.freq_hz * (1.0 - before.freq_error));
    EXPECT_GT(trial.value(trial.bands), before.freq_hz * (1.0 + before.freq_error));
    EXPECT_NEAR(trial.value((trial.bands + 1) / 2), before.freq_hz, 1e-9 * before.freq_hz);
    EXPECT_LE(trial.bands, 41U);
    EXPECT_LE(trial.waves.accel_mm_s2, 0.7 * print_mm_s2 * (1.0 + 1e-12));
    EXPECT_LE(trial.waves.count, 8);
    EXPECT_DOUBLE_EQ(trial.damping_ratio(1), before.damping_ratio);
  }
}

TEST(Trial, KeepsTheDampingRatiosPositive) {
  const Trial trial = next_trial(known(45.0, 0.02, 1), kAccel_mm_s2);
  EXPECT_GT(trial.value(1), 0.0);
  EXPECT_GE(trial.value(trial.bands), 0.15);
  EXPECT_DOUBLE_EQ(trial.freq_hz(7), 45.0);
}

// What passes from the reference to the nozzle at the pole of the axis is as much at one edge of
// the zone as at the other. The other edge is found here by bisection.
TEST(Trial, ReadsTheFrequencyBetweenEdgesThatLetThroughTheSame) {
  constexpr double kTrue_hz = 47.3;
  const auto let_through = [&](double made_for_hz) {
    return std::abs(1.0 - std::pow(kTrue_hz / made_for_hz, 2));
  };
  const double high_hz = 51.0;
  double low_hz = 40.0;
  for (double step_hz = 3.0; step_hz > 1e-12; step_hz /= 2.0) {
    low_hz += let_through(low_hz + step_hz) > let_through(high_hz) ? step_hz : 0.0;
  }
  // Bands 2 and 4 are the edges.
  Trial trial{.bands = 5};
  trial.step = std::sqrt(high_hz / low_hz);
  trial.first = low_hz / trial.step;
  const Result<Knowledge> after = read(trial, {2, 4});
  ASSERT_TRUE(after);
  EXPECT_NEAR(after->freq_hz, kTrue_hz, 1e-6);
  EXPECT_EQ(after->rounds, 1U);
}

TEST(Trial, TriesTheFrequencyAgainIfTheZoneMayGoOn) {
  const Trial trial = next_trial(known(45.0, 0.02, 2), kAccel_mm_s2);
  const Result<Knowledge> after = read(trial, {trial.bands - 3, trial.bands});
  ASSERT_TRUE(after);
  EXPECT_EQ(after->rounds, 2U);
  EXPECT_GT(after->freq_hz * (1.0 + after->freq_error), trial.value(trial.bands));
  EXPECT_EQ(next_trial(*after, kAccel_mm_s2).parameter, Parameter::freq_hz);
}

TEST(Trial, ReadsTheDampingRatioInTheMiddleOfTheZone) {
  const Trial trial = next_trial(known(45.0, 0.02, 1), kAccel_mm_s2);
  const Result<Knowledge> after = read(trial, {6, 10});
  ASSERT_TRUE(after);
  EXPECT_DOUBLE_EQ(after->damping_ratio, 0.5 * (trial.value(6) + trial.value(10)));
  EXPECT_EQ(after->rounds, 2U);
  EXPECT_LT(after->damping_error, trial.known.damping_error);
  EXPECT_DOUBLE_EQ(after->freq_error, 0.02);
}

TEST(Trial, RefusesBandsThatTheTowerDoesNotHave) {
  const Trial trial = next_trial({}, kAccel_mm_s2);
  EXPECT_FALSE(read(trial, {0, 3}));
  EXPECT_FALSE(read(trial, {5, 4}));
  EXPECT_FALSE(read(trial, {5, trial.bands + 1}));
}

TEST(Trial, StandsInACommentAndComesBack) {
  for (const Knowledge& before : {Knowledge{}, known(45.25, 0.02, 1), known(30.0, 0.004, 2)}) {
    const Trial trial = next_trial(before, kAccel_mm_s2);
    const Result<AxisTrial> back = from_comment(to_comment('y', trial), {"tower.gcode", 3});
    ASSERT_TRUE(back);
    EXPECT_EQ(back->axis, 'y');
    EXPECT_EQ(back->trial.parameter, trial.parameter);
    EXPECT_EQ(back->trial.bands, trial.bands);
    EXPECT_NEAR(back->trial.value(trial.bands), trial.value(trial.bands), 2e-3);
    EXPECT_NEAR(back->trial.known.freq_hz, before.freq_hz, 1e-4);
    EXPECT_EQ(back->trial.known.rounds, before.rounds);
    EXPECT_EQ(back->trial.waves.count, trial.waves.count);
  }
}

TEST(Trial, RefusesASpoiltCommentWithItsLine) {
  const std::string good = to_comment('x', next_trial({}, kAccel_mm_s2));
  for (std::size_t cut = kTrialMark.size(); cut <= good.rfind('='); ++cut) {
    const Result<AxisTrial> back = from_comment(good.substr(0, cut), {"tower.gcode", 3});
    ASSERT_FALSE(back) << good.substr(0, cut);
    EXPECT_EQ(back.error().place.line, 3U);
  }
  EXPECT_FALSE(from_comment("; unflex tune: axis=z parameter=freq_hz", {"tower.gcode", 3}));
}

}  // namespace
}  // namespace unflex::tune
