// Fits of several modes to spectra.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "modes_simulation.hpp"
#include "sweep_simulation.hpp"
#include "unflex/identify/modes.hpp"
#include "welch.hpp"

namespace unflex::identify {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

const std::vector<ModeOfAxis> kThreeModes = {
    {45.0, 0.07, 0.75}, {75.0, 0.05, 0.35}, {105.0, 0.05, -0.1}};

TEST(ModesFit, FindsThreeModesWithTheirGains) {
  const Result<ModesFit> fit =
      fit_modes(simulate({.modes = kThreeModes, .noise = 1e-4, .rise = 1e-4, .windows = 60}), {});
  ASSERT_TRUE(fit) << fit.error().message;
  ASSERT_THAT(fit->modes, SizeIs(3));
  EXPECT_EQ(fit->column, 0);
  for (std::size_t m = 0; m < 3; ++m) {
    EXPECT_NEAR(fit->modes[m].freq_hz, kThreeModes[m].freq_hz, 0.02 * kThreeModes[m].freq_hz) << m;
    EXPECT_NEAR(fit->modes[m].damping_ratio, kThreeModes[m].damping_ratio, 0.02) << m;
    EXPECT_NEAR(fit->modes[m].gain, kThreeModes[m].gain, 0.08) << m;
  }
  EXPECT_LT(fit->unexplained, 0.15);
  EXPECT_TRUE(fit->warnings.empty());
  EXPECT_THAT(fit->bic, SizeIs(4));
  EXPECT_THAT(fit->covariance, SizeIs(81));
  EXPECT_EQ(fit->curve.x.size(), fit->noise_curve.size());
  EXPECT_THAT(fit->mode_curves, SizeIs(3));
}

// One mode of 25 to 110 Hz with up to two weaker ones, at least 8 Hz apart.
std::vector<ModeOfAxis> drawn_modes(std::mt19937& random) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto swing = [](const ModeOfAxis& m) {
    return std::abs(m.gain) / (m.damping_ratio * m.freq_hz);
  };
  const auto count = static_cast<std::size_t>(uniform(1.0, 3.999));
  for (;;) {
    std::vector<ModeOfAxis> modes = {{uniform(25.0, 110.0), uniform(0.03, 0.15), 1.0}};
    bool is_fine = true;
    while (modes.size() < count) {
      const double gain = uniform(0.05, 0.4) * (uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0);
      modes.push_back({uniform(25.0, 125.0), uniform(0.03, 0.15), gain});
      modes.front().gain -= gain;
      for (std::size_t i = 0; i + 1 < modes.size(); ++i) {
        is_fine &= std::abs(modes[i].freq_hz - modes.back().freq_hz) >= 8.0;
      }
    }
    for (std::size_t i = 1; i < modes.size(); ++i) {
      // Chance would tell which of two alike is the main one.
      is_fine &= 1.3 * swing(modes[i]) < swing(modes.front());
    }
    if (is_fine) {
      return modes;
    }
  }
}

TEST(ModesFit, FindsTheMainModeOfRandomAxesWithTurnedSensors) {
  constexpr int kDraws = 40;
  int accepted = 0;
  int near = 0;
  int held = 0;
  for (int i = 0; i < kDraws; ++i) {
    std::mt19937 random(static_cast<std::uint32_t>(100 + i));
    std::normal_distribution<double> chance;
    std::array<double, 3> direction = {chance(random), chance(random), chance(random)};
    const double length = std::hypot(direction[0], direction[1], direction[2]);
    for (double& part : direction) {
      part /= length;
    }
    const std::vector<ModeOfAxis> modes = drawn_modes(random);
    const Result<ModesFit> fit = fit_modes(simulate({.modes = modes,
                                                     .direction = direction,
                                                     .windows = 20,
                                                     .seed = static_cast<std::uint32_t>(i + 1)}),
                                           {});
    if (fit) {
      const double true_hz = modes.front().freq_hz;
      const Estimate& main_hz = fit->intervals.front().freq_hz;
      ++accepted;
      near += std::abs(main_hz.value - true_hz) < 0.02 * true_hz ? 1 : 0;
      held += main_hz.low <= true_hz && true_hz <= main_hz.high ? 1 : 0;
    }
  }
  EXPECT_GE(accepted, 37);
  EXPECT_GE(near, accepted - 4);
  EXPECT_GE(held, accepted - 4);
}

TEST(ModesFit, OfASimulatedSweepTellsItsOneMode) {
  const SimulatedTest test{.mode_hz = 52.0, .damping_ratio = 0.08};
  for (const bool is_normalized : {false, true}) {
    const Result<ModesFit> fit = fit_modes(welch(simulate(test), test.rate_hz, is_normalized), {});
    ASSERT_TRUE(fit) << fit.error().message;
    EXPECT_EQ(fit->column, -1);
    EXPECT_NEAR(fit->modes.front().freq_hz, 52.0, 0.52);
    EXPECT_NEAR(fit->modes.front().damping_ratio, 0.08, 0.012);
    EXPECT_NEAR(fit->modes.front().gain, 1.0, 0.1);
  }
}

TEST(ModesFit, PlantsAreTheFitAndMachinesAroundIt) {
  const Result<ModesFit> fit = fit_modes(simulate({.modes = kThreeModes}), {});
  ASSERT_TRUE(fit) << fit.error().message;
  ASSERT_GE(fit->plants.size(), 5U);
  double shares = 0.0;
  for (const Plant& plant : fit->plants) {
    double gains = 0.0;
    for (const ModeOfAxis& mode : plant.modes) {
      gains += mode.gain;
      EXPECT_GT(mode.damping_ratio, 0.0);
    }
    EXPECT_NEAR(gains, 1.0, 1e-9);
    shares += plant.share;
  }
  EXPECT_NEAR(shares, 1.0, 1e-9);
  EXPECT_EQ(fit->plants.front().modes.front().freq_hz, fit->modes.front().freq_hz);
  EXPECT_NE(fit->plants[1].modes.front().freq_hz, fit->modes.front().freq_hz);
}

TEST(ModesFit, GivesTheSameNumbersEachTime) {
  const Spectrum spectrum = simulate({.modes = kThreeModes});
  const Result<ModesFit> first = fit_modes(spectrum, {});
  const Result<ModesFit> second = fit_modes(spectrum, {});
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->covariance, second->covariance);
  EXPECT_EQ(first->curve.fitted, second->curve.fitted);
}

TEST(ModesFit, WithoutAResonanceIsRefused) {
  Spectrum spectrum = simulate({.modes = {{1e5, 0.1, 1.0}}});
  const Result<ModesFit> rigid = fit_modes(spectrum, {});
  ASSERT_FALSE(rigid);
  EXPECT_EQ(rigid.error().kind, ErrorKind::input);
  EXPECT_THAT(rigid.error().message, HasSubstr("measure again"));
  const Result<ModesFit> noise =
      fit_modes(simulate({.modes = kThreeModes, .noise = 1e4, .rise = 1e3}), {});
  EXPECT_FALSE(noise);
  spectrum.density.fill(std::vector<double>(100, 0.0));
  const Result<ModesFit> still = fit_modes(spectrum, {});
  ASSERT_FALSE(still);
  EXPECT_EQ(still.error().message, "there is no motion in the band of the sweep");
  spectrum.density.fill(std::vector<double>(20, 1.0));
  EXPECT_FALSE(fit_modes(spectrum, {}));
}

TEST(DensityOfAxis, IsTheColumnWithMostOfTheMotionOrTheSum) {
  const AxisDensity turned =
      density_of_axis(simulate({.modes = kThreeModes, .direction = {0.1, 0.2, 0.97}}), {});
  EXPECT_EQ(turned.column, 2);
  EXPECT_GT(turned.share, 0.9);
  const Spectrum odd = simulate({.modes = kThreeModes, .direction = {0.0, 0.7, 0.7}});
  const AxisDensity sum = density_of_axis(odd, {});
  EXPECT_EQ(sum.column, -1);
  EXPECT_DOUBLE_EQ(sum.density[30], odd.density[0][30] + odd.density[1][30] + odd.density[2][30]);
}

}  // namespace
}  // namespace unflex::identify
