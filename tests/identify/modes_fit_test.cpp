// Fits of several modes to spectra.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "modes_simulation.hpp"
#include "sweep_simulation.hpp"
#include "unflex/identify/axis_model.hpp"
#include "welch.hpp"

namespace unflex::identify {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

const std::vector<ModeOfAxis> kThreeModes = {
    {45.0, 0.07, 0.75}, {75.0, 0.05, 0.35}, {105.0, 0.05, -0.1}};

TEST(ModesFit, FindsThreeModesWithTheirGains) {
  const Result<RecordFit> fit = fit_spectrum(
      simulate({.modes = kThreeModes, .noise = 1e-4, .rise = 1e-4, .windows = 60}), {});
  ASSERT_TRUE(fit) << fit.error().message;
  ASSERT_THAT(fit->model.values(), SizeIs(3));
  EXPECT_TRUE(fit->is_trusted());
  EXPECT_GT(fit->direction[0], 0.95);
  for (std::size_t m = 0; m < 3; ++m) {
    EXPECT_NEAR(fit->model.values()[m].freq_hz, kThreeModes[m].freq_hz,
                0.02 * kThreeModes[m].freq_hz)
        << m;
    EXPECT_NEAR(fit->model.values()[m].damping_ratio, kThreeModes[m].damping_ratio, 0.02) << m;
    EXPECT_NEAR(fit->model.values()[m].gain, kThreeModes[m].gain, 0.08) << m;
  }
  EXPECT_LT(fit->unexplained, 0.15);
  EXPECT_TRUE(fit->warnings.empty());
  EXPECT_THAT(fit->bic, SizeIs(4));
  EXPECT_THAT(fit->model.covariance, SizeIs(81));
  EXPECT_EQ(fit->curve.x.size(), fit->curve.noise.size());
  EXPECT_THAT(fit->curve.modes, SizeIs(3));
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
    const Result<RecordFit> fit =
        fit_spectrum(simulate({.modes = modes,
                               .direction = direction,
                               .windows = 20,
                               .seed = static_cast<std::uint32_t>(i + 1)}),
                     {});
    if (fit && fit->is_trusted()) {
      const double true_hz = modes.front().freq_hz;
      const Estimate& main_hz = fit->model.modes.front().freq_hz;
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
    const Result<RecordFit> fit =
        fit_spectrum(welch(simulate(test), test.rate_hz, is_normalized), {});
    ASSERT_TRUE(fit) << fit.error().message;
    EXPECT_NEAR(fit->direction[0], std::sqrt(1.0 / 3.0), 1e-9);
    EXPECT_NEAR(fit->model.values().front().freq_hz, 52.0, 0.52);
    EXPECT_NEAR(fit->model.values().front().damping_ratio, 0.08, 0.012);
    EXPECT_NEAR(fit->model.values().front().gain, 1.0, 0.1);
  }
}

TEST(ModesFit, PlantsAreTheFitAndMachinesAroundIt) {
  const Result<RecordFit> fit = fit_spectrum(simulate({.modes = kThreeModes}), {});
  ASSERT_TRUE(fit) << fit.error().message;
  ASSERT_GE(fit->model.plants.size(), 5U);
  double shares = 0.0;
  for (const Plant& plant : fit->model.plants) {
    double gains = 0.0;
    for (const ModeOfAxis& mode : plant.modes) {
      gains += mode.gain;
      EXPECT_GT(mode.damping_ratio, 0.0);
    }
    EXPECT_NEAR(gains, 1.0, 1e-9);
    shares += plant.share;
  }
  EXPECT_NEAR(shares, 1.0, 1e-9);
  EXPECT_EQ(fit->model.plants.front().modes.front().freq_hz, fit->model.values().front().freq_hz);
  EXPECT_NE(fit->model.plants[1].modes.front().freq_hz, fit->model.values().front().freq_hz);
}

TEST(ModesFit, GivesTheSameNumbersEachTime) {
  const Spectrum spectrum = simulate({.modes = kThreeModes});
  const Result<RecordFit> first = fit_spectrum(spectrum, {});
  const Result<RecordFit> second = fit_spectrum(spectrum, {});
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->model.covariance, second->model.covariance);
  EXPECT_EQ(first->curve.fitted, second->curve.fitted);
}

TEST(ModesFit, WithoutAResonanceIsRefused) {
  Spectrum spectrum = simulate({.modes = {{1e5, 0.1, 1.0}}});
  const Result<RecordFit> rigid = fit_spectrum(spectrum, {});
  ASSERT_TRUE(rigid);
  EXPECT_THAT(rigid->refusal, HasSubstr("measure again"));
  EXPECT_EQ(rigid->curve.x.size(), rigid->curve.fitted.size());
  const Result<RecordFit> noise =
      fit_spectrum(simulate({.modes = kThreeModes, .noise = 1e4, .rise = 1e3}), {});
  ASSERT_TRUE(noise);
  EXPECT_FALSE(noise->is_trusted());
  spectrum.density.fill(std::vector<double>(100, 0.0));
  const Result<RecordFit> still = fit_spectrum(spectrum, {});
  ASSERT_FALSE(still);
  EXPECT_EQ(still.error().message, "there is no motion in the band of the sweep");
  spectrum.density.fill(std::vector<double>(20, 1.0));
  EXPECT_FALSE(fit_spectrum(spectrum, {}));
}

TEST(ModesFit, TakesTheColumnWithMostOfTheMotionOrTheSum) {
  const SimulatedSpectrum turned{.modes = kThreeModes, .direction = {0.1, 0.2, 0.97}};
  const Result<RecordFit> column = fit_spectrum(simulate(turned), {});
  ASSERT_TRUE(column);
  EXPECT_GT(column->direction[2], 0.95);
  const Spectrum odd = simulate({.modes = kThreeModes, .direction = {0.0, 0.7, 0.7}});
  const Result<RecordFit> sum = fit_spectrum(odd, {});
  ASSERT_TRUE(sum);
  EXPECT_NEAR(sum->direction[1], std::sqrt(0.5), 0.05);
  Spectrum added{.step_hz = odd.step_hz, .density = {}};
  added.density.fill({});
  for (std::size_t k = 0; k < odd.density[0].size(); ++k) {
    added.density[0].push_back(odd.density[0][k] + odd.density[1][k] + odd.density[2][k]);
  }
  added.density[1] = added.density[2] = std::vector<double>(odd.density[0].size(), 0.0);
  const Result<RecordFit> as_one = fit_spectrum(added, {});
  ASSERT_TRUE(as_one);
  EXPECT_EQ(sum->curve.fitted, as_one->curve.fitted);
}

}  // namespace
}  // namespace unflex::identify
