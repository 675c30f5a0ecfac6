// Modes are found again in simulated sweeps of Klipper, and their confidence intervals are right.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "sweep_simulation.hpp"
#include "unflex/identify/mode.hpp"
#include "welch.hpp"

namespace unflex::identify {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// docs/identify.md reports UNFLEX_IDENTIFY_DRAWS=200.
int number_of_draws() {
  constexpr int kDefault = 40;
  const char* const wanted = std::getenv("UNFLEX_IDENTIFY_DRAWS");
  return wanted == nullptr ? kDefault : std::max(kDefault, std::atoi(wanted));
}

Recording recording_of(const SimulatedTest& test) {
  const std::vector<double> samples = simulate(test);
  return {.rate_hz = test.rate_hz, .accel = {samples, samples, samples}};
}

bool holds(const Estimate& estimate, double truth) {
  return estimate.low <= truth && truth <= estimate.high;
}

TEST(RecordedSweep, TellsFrequencyAndDampingWithHonestIntervals) {
  const int draws = number_of_draws();
  std::mt19937 random(20);
  int close_freq = 0;
  int close_damping = 0;
  int held_freq = 0;
  int held_damping = 0;
  for (int draw = 0; draw < draws; ++draw) {
    SimulatedTest test;
    test.mode_hz = std::uniform_real_distribution(20.0, 120.0)(random);
    test.damping_ratio = std::uniform_real_distribution(0.02, 0.3)(random);
    test.sweeping_accel = draw % 2 == 0 ? 400.0 : 0.0;
    test.seed = static_cast<std::uint32_t>(random());
    const Result<Mode> mode = fit_recording(recording_of(test), Axis::x, {});
    ASSERT_TRUE(mode) << test.mode_hz << " " << test.damping_ratio;
    EXPECT_EQ(mode->method, Method::sweep);
    EXPECT_THAT(mode->warnings, IsEmpty()) << test.mode_hz << " " << test.damping_ratio;
    close_freq += std::abs(mode->freq_hz.value / test.mode_hz - 1.0) < 0.01;
    close_damping += std::abs(mode->damping_ratio.value / test.damping_ratio - 1.0) < 0.15;
    held_freq += holds(mode->freq_hz, test.mode_hz);
    held_damping += holds(mode->damping_ratio, test.damping_ratio);
  }
  std::printf("of %d draws: f within 1 %% %d, zeta within 15 %% %d, intervals hold f %d, zeta %d\n",
              draws, close_freq, close_damping, held_freq, held_damping);
  EXPECT_GE(close_freq, 0.95 * draws);
  EXPECT_GE(close_damping, 0.95 * draws);
  EXPECT_GE(held_freq, 0.9 * draws);
  EXPECT_GE(held_damping, 0.9 * draws);
  if (draws >= 200) {  // with fewer draws all intervals may well hold
    EXPECT_LE(held_freq, 0.99 * draws);
    EXPECT_LE(held_damping, 0.99 * draws);
  }
}

TEST(RecordedSweep, OfOlderAndFasterTestsIsReadToo) {
  SimulatedTest older{.end_hz = 133.33, .accel_per_hz = 75.0, .sweeping_accel = 0.0};
  SimulatedTest faster{.hz_per_s = 2.0};
  SimulatedTest slow_chip{.rate_hz = 1600.0};
  for (const SimulatedTest& test : {older, faster, slow_chip}) {
    const Result<Mode> mode = fit_recording(recording_of(test), Axis::y, {});
    ASSERT_TRUE(mode);
    EXPECT_NEAR(mode->freq_hz.value, test.mode_hz, 0.003 * test.mode_hz);
    EXPECT_NEAR(mode->damping_ratio.value, test.damping_ratio, 0.03 * test.damping_ratio);
  }
}

TEST(RecordedSweep, OfAnotherRangeIsReadWhereThatIsTold) {
  const SimulatedTest test{.start_hz = 20.0, .end_hz = 80.0, .noise_share = 0.01};
  const Result<Mode> told = fit_recording(recording_of(test), Axis::x, {20.0, 79.0});
  ASSERT_TRUE(told);
  EXPECT_NEAR(told->freq_hz.value, 45.0, 0.05);
  EXPECT_NEAR(told->damping_ratio.value, 0.06, 0.002);
}

TEST(RecordedSweep, OfTwoModesBringsAWarningThatNamesTheOther) {
  Recording both = recording_of({.mode_hz = 45.0, .noise_share = 0.01, .seed = 1});
  const Recording other = recording_of({.mode_hz = 70.0, .noise_share = 0.01, .seed = 2});
  const std::size_t length = std::min(both.accel[0].size(), other.accel[0].size());
  for (std::size_t i = 0; i < length; ++i) {
    both.accel[0][i] += 0.6 * other.accel[0][i];
  }
  const Result<Mode> mode = fit_recording(both, Axis::x, {});
  ASSERT_TRUE(mode);
  ASSERT_THAT(mode->warnings, SizeIs(1));
  EXPECT_THAT(mode->warnings[0], HasSubstr("another peak near 70"));
}

TEST(RecordedSweep, ThatEndsBelowTheResonanceBringsAWarning) {
  const Result<Mode> mode =
      fit_recording(recording_of({.mode_hz = 160.0, .noise_share = 0.01}), Axis::x, {});
  ASSERT_TRUE(mode);
  ASSERT_FALSE(mode->warnings.empty());
  EXPECT_THAT(mode->warnings.back(), HasSubstr("at the edge of the sweep"));
}

std::string refusal(const Result<Mode>& mode) { return mode ? "" : mode.error().message; }

TEST(RecordedSweep, BeyondWhatItsSamplesShowIsRefused) {
  const Recording slow{.rate_hz = 1000.0, .accel = {std::vector<double>(20000, 1.0), {}, {}}};
  EXPECT_EQ(refusal(fit_recording(slow, Axis::x, {5.0, 1000.0})),
            "1000 samples a second do not show a sweep up to 1000 Hz; say with --freq-end, at most "
            "400, where the test ended");
  EXPECT_EQ(refusal(fit_recording(slow, Axis::x, {5.0, 400.0})),
            "there is no motion in the band of the sweep");
}

TEST(RecordedSweep, WithoutMotionIsRefused) {
  Recording still{.rate_hz = 3200.0, .accel = {}};
  still.accel.fill(std::vector<double>(100000, 9.81));
  EXPECT_EQ(refusal(fit_recording(still, Axis::x, {})),
            "there is no motion in the band of the sweep");
  std::mt19937 random(4);
  std::normal_distribution<double> chance;
  for (double& sample : still.accel[1]) {
    sample += chance(random);
  }
  EXPECT_EQ(refusal(fit_recording(still, Axis::y, {})),
            "no resonance stands out of the noise in it");
}

TEST(Spectrum, WithoutMotionOrOutsideTheSweepIsRefused) {
  Spectrum spectrum{.step_hz = 1.5625, .density = {}};
  spectrum.density.fill(std::vector<double>(20, 1.0));
  EXPECT_EQ(refusal(fit_spectrum(spectrum, Axis::x, {})),
            "it has too few frequencies in the band of the sweep");
  spectrum.density.fill(std::vector<double>(120, 0.0));
  EXPECT_EQ(refusal(fit_spectrum(spectrum, Axis::x, {})),
            "there is no motion in the band of the sweep");
}

TEST(Spectrum, OfASweepTellsTheModeNormalizedOrNot) {
  for (const double mode_hz : {25.0, 47.0, 110.0}) {
    for (const double damping_ratio : {0.04, 0.15}) {
      for (const bool is_normalized : {false, true}) {
        const SimulatedTest test{.mode_hz = mode_hz, .damping_ratio = damping_ratio};
        const Result<Mode> mode =
            fit_spectrum(welch(simulate(test), test.rate_hz, is_normalized), Axis::x, {});
        ASSERT_TRUE(mode);
        EXPECT_THAT(mode->warnings, IsEmpty());
        EXPECT_NEAR(mode->freq_hz.value, mode_hz, 0.005 * mode_hz);
        EXPECT_NEAR(mode->damping_ratio.value, damping_ratio, 0.06 * damping_ratio);
      }
    }
  }
}

}  // namespace
}  // namespace unflex::identify
