// Ringing, towers, and several records of one mode.

#include "unflex/identify/mode.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "sweep_simulation.hpp"

namespace unflex::identify {
namespace {

using ::testing::SizeIs;

// The record of an accelerometer for a move that ends after 0.4 s.
Recording stop_of_a_move(double mode_hz, double damping_ratio, double noise) {
  const SimulatedTest test{.mode_hz = mode_hz, .damping_ratio = damping_ratio, .rate_hz = 1344.0};
  const std::vector<Pulse> move = {{0.05, 3000.0}, {0.35, 0.0}, {0.4, -3000.0}, {0.9, 0.0}};
  std::vector<double> samples = response(test, move, 0.0);
  std::mt19937 random(3);
  std::normal_distribution<double> chance(0.0, noise);
  for (double& sample : samples) {
    sample += 200.0 + chance(random);
  }
  return {.rate_hz = test.rate_hz, .accel = {samples, samples, samples}};
}

TEST(Ringing, AfterAMoveTellsTheMode) {
  for (const auto& [mode_hz, damping_ratio] : {std::pair{30.0, 0.05}, std::pair{62.0, 0.09}}) {
    const Result<Mode> mode =
        fit_recording(stop_of_a_move(mode_hz, damping_ratio, 60.0), Axis::x, {});
    ASSERT_TRUE(mode) << mode_hz;
    EXPECT_EQ(mode->method, Method::ringing);
    EXPECT_NEAR(mode->freq_hz.value, mode_hz, 0.01 * mode_hz);
    EXPECT_NEAR(mode->damping_ratio.value, damping_ratio, 0.15 * damping_ratio);
    EXPECT_LT(mode->freq_hz.low, mode_hz);
    EXPECT_GT(mode->freq_hz.high, mode_hz);
  }
}

TEST(Ringing, WithoutMotionIsRefused) {
  Recording still{.rate_hz = 1344.0, .accel = {}};
  still.accel.fill(std::vector<double>(1000, 9.81));
  const Result<Mode> mode = fit_recording(still, Axis::x, {});
  ASSERT_FALSE(mode);
  EXPECT_EQ(mode.error().message, "there is no motion in it, or it is too short");
}

TEST(Ringing, ThatDrownsInNoiseIsRefusedOrDoubted) {
  Recording noise{.rate_hz = 1344.0, .accel = {}};
  std::mt19937 random(5);
  std::normal_distribution<double> chance;
  for (int i = 0; i < 1000; ++i) {
    noise.accel[0].push_back(chance(random));
  }
  const Result<Mode> mode = fit_recording(noise, Axis::x, {});
  EXPECT_TRUE(!mode || !mode->warnings.empty());
}

TEST(Tower, TellsFrequencyBySpacingAndDampingByDecay) {
  const double damping_ratio = 0.08;
  const double decay = std::exp(2.0 * std::numbers::pi * damping_ratio /
                                std::sqrt(1.0 - damping_ratio * damping_ratio));
  const Result<Mode> mode = fit_tower({.spacing_mm = 2.0,
                                       .spacing_spread_mm = 0.1,
                                       .speed_mm_s = 100.0,
                                       .decay = decay,
                                       .decay_spread = 0.1});
  ASSERT_TRUE(mode);
  EXPECT_DOUBLE_EQ(mode->freq_hz.value, 50.0);
  EXPECT_NEAR(mode->freq_hz.low, 50.0 * std::exp(-0.05), 1e-9);
  EXPECT_NEAR(mode->damping_ratio.value, damping_ratio, 1e-12);
  EXPECT_LT(mode->damping_ratio.low, damping_ratio);
  EXPECT_GT(mode->damping_ratio.high, damping_ratio);
}

TEST(Tower, NeedsASpacingAndASpeed) {
  for (const Tower& tower : {Tower{.spacing_mm = 0.0, .speed_mm_s = 100.0},
                             Tower{.spacing_mm = 2.0, .speed_mm_s = -1.0}}) {
    const Result<Mode> mode = fit_tower(tower);
    ASSERT_FALSE(mode);
    EXPECT_EQ(mode.error().message, "the waves' spacing and the speed must be above 0");
  }
}

TEST(Tower, OfNoPrintersFrequencyIsRefused) {
  const Result<Mode> mode = fit_tower({.spacing_mm = 0.01, .speed_mm_s = 80.0});
  ASSERT_FALSE(mode);
  EXPECT_EQ(mode.error().message,
            "waves 0.01 mm apart at 80 mm/s are a frequency of 8000 Hz, which no printer's belts "
            "have; give the spacing in mm and the speed in mm/s");
}

TEST(Tower, WithoutDecayLeavesTheDampingAGuess) {
  const Result<Mode> mode = fit_tower({.spacing_mm = 2.0, .speed_mm_s = 100.0});
  ASSERT_TRUE(mode);
  EXPECT_THAT(mode->warnings, SizeIs(1));
  EXPECT_DOUBLE_EQ(mode->damping_ratio.value, 0.1);
  EXPECT_FALSE(fit_tower({.spacing_mm = 2.0, .speed_mm_s = 100.0, .decay = 0.9}));
}

Mode mode_at(double freq_hz, double spread) {
  Mode mode;
  mode.freq_hz = {freq_hz, freq_hz / (1.0 + spread), freq_hz * (1.0 + spread)};
  mode.damping_ratio = {0.1, 0.08, 0.125};
  return mode;
}

TEST(Combined, RecordsWeighByTheirIntervals) {
  const Mode mode = combine({mode_at(40.0, 0.001), mode_at(40.1, 0.1)});
  EXPECT_EQ(mode.method, Method::combined);
  EXPECT_NEAR(mode.freq_hz.value, 40.0, 1e-3);
  EXPECT_LT(mode.freq_hz.high, 40.05);
}

TEST(Combined, RecordsThatDisagreeWidenTheInterval) {
  const Mode alike = combine({mode_at(40.0, 0.01), mode_at(40.0, 0.01)});
  const Mode apart = combine({mode_at(40.0, 0.01), mode_at(44.0, 0.01)});
  EXPECT_LT(alike.freq_hz.high / alike.freq_hz.value, 1.01);
  EXPECT_LT(apart.freq_hz.low, 40.1);
  EXPECT_GT(apart.freq_hz.high, 43.9);
}

TEST(DominantAxis, IsTheOneThatMovedMore) {
  DataSet set;
  Recording recording{.rate_hz = 100.0, .accel = {}};
  for (int i = 0; i < 100; ++i) {
    recording.accel[0].push_back(9.81);
    recording.accel[1].push_back(i % 2);
  }
  set.data = recording;
  EXPECT_EQ(dominant_axis(set), Axis::y);
}

}  // namespace
}  // namespace unflex::identify
