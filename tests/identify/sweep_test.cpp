// Modes are found again in simulated sweeps of Klipper, and their confidence intervals are right.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "modes_simulation.hpp"
#include "sweep_simulation.hpp"
#include "unflex/identify/axis_model.hpp"
#include "welch.hpp"

namespace unflex::identify {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

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

struct Tally {
  int accepted = 0;
  int close_freq = 0;
  int close_damping = 0;
  int held_freq = 0;
  int held_damping = 0;

  void add(const RecordFit& fit, double freq_hz, double damping_ratio) {
    const ModeEstimate& mode = fit.model.modes.front();
    ++accepted;
    close_freq += std::abs(mode.freq_hz.value / freq_hz - 1.0) < 0.01;
    close_damping += std::abs(mode.damping_ratio.value / damping_ratio - 1.0) < 0.15;
    held_freq += holds(mode.freq_hz, freq_hz);
    held_damping += holds(mode.damping_ratio, damping_ratio);
  }
  void print(int draws) const {
    std::printf(
        "of %d draws %d accepted: f within 1 %% %d, zeta within 15 %% %d, intervals hold f %d, "
        "zeta %d\n",
        draws, accepted, close_freq, close_damping, held_freq, held_damping);
  }
};

TEST(RecordedSweep, TellsFrequencyAndDampingWithHonestIntervals) {
  const int draws = number_of_draws();
  std::mt19937 random(20);
  Tally tally;
  for (int draw = 0; draw < draws; ++draw) {
    SimulatedTest test;
    test.mode_hz = std::uniform_real_distribution(20.0, 120.0)(random);
    test.damping_ratio = std::uniform_real_distribution(0.02, 0.25)(random);
    test.sweeping_accel = draw % 2 == 0 ? 400.0 : 0.0;
    test.seed = static_cast<std::uint32_t>(random());
    const Result<RecordFit> fit = fit_recording(recording_of(test), Axis::x, {});
    ASSERT_TRUE(fit) << test.mode_hz << " " << test.damping_ratio;
    if (fit->is_trusted()) {
      EXPECT_EQ(fit->model.method, Method::sweep);
      tally.add(*fit, test.mode_hz, test.damping_ratio);
    }
  }
  tally.print(draws);
  EXPECT_GE(tally.accepted, 0.95 * draws);
  EXPECT_GE(tally.close_freq, 0.95 * tally.accepted);
  EXPECT_GE(tally.close_damping, 0.95 * tally.accepted);
  EXPECT_GE(tally.held_freq, 0.9 * tally.accepted);
  EXPECT_GE(tally.held_damping, 0.9 * tally.accepted);
}

// The samples along one direction of the sensor, with noise in all three columns.
Recording turned(const SimulatedTest& test, double noise_share, std::mt19937& random) {
  const std::vector<double> samples = simulate(test);
  const auto [least, most] = std::ranges::minmax(samples);
  std::normal_distribution<double> chance;
  std::array<double, 3> direction = {chance(random), chance(random), chance(random)};
  const double length = std::hypot(direction[0], direction[1], direction[2]);
  Recording recording{.rate_hz = test.rate_hz, .accel = {}};
  for (std::size_t c = 0; c < 3; ++c) {
    for (const double sample : samples) {
      recording.accel[c].push_back(direction[c] / length * sample +
                                   noise_share * 0.5 * (most - least) * chance(random));
    }
  }
  return recording;
}

TEST(RecordedSweep, OfUpToThreeModesIsReadHoweverTheSensorIsMounted) {
  const int draws = number_of_draws() / 2;
  Tally tally;
  for (int draw = 0; draw < draws; ++draw) {
    std::mt19937 random(static_cast<std::uint32_t>(500 + draw));
    const std::vector<ModeOfAxis> modes = drawn_modes(random);
    SimulatedTest test{.mode_hz = modes.front().freq_hz,
                       .damping_ratio = modes.front().damping_ratio,
                       .noise_share = 0.01,
                       .seed = static_cast<std::uint32_t>(random())};
    for (std::size_t m = 1; m < modes.size(); ++m) {
      test.further.push_back({modes[m].freq_hz, modes[m].damping_ratio, modes[m].gain});
    }
    const Result<RecordFit> fit = fit_recording(turned(test, 0.05, random), Axis::x, {});
    ASSERT_TRUE(fit) << draw;
    if (fit->is_trusted()) {
      tally.add(*fit, test.mode_hz, test.damping_ratio);
    } else {
      std::printf("draw %d: %s\n", draw, fit->refusal.c_str());
    }
  }
  tally.print(draws);
  EXPECT_GE(tally.accepted, 0.9 * draws);
  EXPECT_GE(tally.close_freq, 0.9 * tally.accepted);
  EXPECT_GE(tally.held_freq, 0.85 * tally.accepted);
}

TEST(RecordedSweep, OfOlderAndFasterTestsIsReadToo) {
  SimulatedTest older{.end_hz = 133.33, .accel_per_hz = 75.0, .sweeping_accel = 0.0};
  SimulatedTest faster{.hz_per_s = 2.0};
  SimulatedTest slow_chip{.rate_hz = 1600.0};
  for (const SimulatedTest& test : {older, faster, slow_chip}) {
    const Result<RecordFit> fit = fit_recording(recording_of(test), Axis::y, {});
    ASSERT_TRUE(fit);
    EXPECT_NEAR(fit->model.modes.front().freq_hz.value, test.mode_hz, 0.003 * test.mode_hz);
    EXPECT_NEAR(fit->model.modes.front().damping_ratio.value, test.damping_ratio,
                0.03 * test.damping_ratio);
  }
}

TEST(RecordedSweep, OfAnotherRangeIsReadWhereThatIsTold) {
  const SimulatedTest test{.start_hz = 20.0, .end_hz = 80.0, .noise_share = 0.01};
  const Result<RecordFit> told = fit_recording(recording_of(test), Axis::x, {20.0, 79.0});
  ASSERT_TRUE(told);
  EXPECT_NEAR(told->model.modes.front().freq_hz.value, 45.0, 0.05);
  EXPECT_NEAR(told->model.modes.front().damping_ratio.value, 0.06, 0.002);
}

std::string refusal(const Result<RecordFit>& fit) {
  return fit ? fit->refusal : fit.error().message;
}

TEST(RecordedSweep, ThatEndsBelowTheResonanceIsRefused) {
  const Result<RecordFit> fit =
      fit_recording(recording_of({.mode_hz = 160.0, .noise_share = 0.01}), Axis::x, {});
  EXPECT_THAT(refusal(fit), HasSubstr("measure again"));
}

TEST(RecordedSweep, BeyondWhatItsSamplesShowIsRefused) {
  Recording slow{.rate_hz = 1000.0, .accel = {}};
  slow.accel.fill(std::vector<double>(20000, 1.0));
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
  EXPECT_THAT(refusal(fit_recording(still, Axis::y, {})), HasSubstr("measure again"));
}

TEST(Spectrum, WithoutMotionOrOutsideTheSweepIsRefused) {
  Spectrum spectrum{.step_hz = 1.5625, .density = {}};
  spectrum.density.fill(std::vector<double>(20, 1.0));
  EXPECT_EQ(refusal(fit_spectrum(spectrum, {})),
            "it has too few frequencies in the band of the sweep");
  spectrum.density.fill(std::vector<double>(120, 0.0));
  EXPECT_EQ(refusal(fit_spectrum(spectrum, {})), "there is no motion in the band of the sweep");
}

TEST(Spectrum, OfASweepTellsTheModeNormalizedOrNot) {
  for (const double mode_hz : {25.0, 47.0, 110.0}) {
    for (const double damping_ratio : {0.04, 0.15}) {
      for (const bool is_normalized : {false, true}) {
        const SimulatedTest test{.mode_hz = mode_hz, .damping_ratio = damping_ratio};
        const Result<RecordFit> fit =
            fit_spectrum(welch(simulate(test), test.rate_hz, is_normalized), {});
        ASSERT_TRUE(fit);
        EXPECT_THAT(fit->warnings, IsEmpty());
        EXPECT_NEAR(fit->model.modes.front().freq_hz.value, mode_hz, 0.005 * mode_hz);
        EXPECT_NEAR(fit->model.modes.front().damping_ratio.value, damping_ratio,
                    0.06 * damping_ratio);
      }
    }
  }
}

}  // namespace
}  // namespace unflex::identify
