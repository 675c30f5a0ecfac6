// Ringing, towers, and several records of one mode.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "sweep_simulation.hpp"
#include "unflex/identify/axis_model.hpp"

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

DataSet stop(std::variant<Recording, Spectrum> data) {
  DataSet set;
  set.name = "stop";
  set.data = std::move(data);
  return set;
}

// A record of a nozzle that follows the move but for a mode behind it, and rings a little with the
// one that it is compensated for.
DataSet compensated_stop(double second_hz, double second_damping, double rest, double noise) {
  Recording recording = stop_of_a_move(second_hz, second_damping, noise);
  const double rate_hz = recording.rate_hz;
  constexpr double kStop_s = 0.9;
  for (std::size_t i = 0; i < recording.accel[0].size(); ++i) {
    const double t = static_cast<double>(i) / rate_hz - kStop_s;
    if (t > 0.0) {
      const double omega = 2.0 * std::numbers::pi * 46.0;
      recording.accel[0][i] += rest * std::exp(-0.06 * omega * t) * std::cos(omega * t);
    }
  }
  return stop(recording);
}

TEST(SecondMode, RingsBehindACompensatedStop) {
  const std::vector<ModeOfAxis> known = {{45.0, 0.06, 1.0}};
  for (const auto& [freq_hz, damping_ratio] : {std::pair(110.0, 0.05), std::pair(71.0, 0.04)}) {
    for (const double rest : {0.0, 600.0}) {
      const Result<RecordFit> fit =
          fit_second(compensated_stop(freq_hz, damping_ratio, rest, 40.0), Axis::x, known);
      ASSERT_TRUE(fit && fit->is_trusted()) << freq_hz << (fit ? fit->refusal : "");
      EXPECT_NEAR(fit->model.modes.front().freq_hz.value, freq_hz, 0.02 * freq_hz);
      EXPECT_NEAR(fit->model.modes.front().damping_ratio.value, damping_ratio,
                  0.35 * damping_ratio);
    }
  }
}

TEST(SecondMode, IsNotTheKnownOne) {
  const std::vector<ModeOfAxis> known = {{45.0, 0.06, 1.0}};
  const Result<RecordFit> fit = fit_second(stop(stop_of_a_move(46.0, 0.05, 60.0)), Axis::x, known);
  ASSERT_TRUE(fit);
  EXPECT_FALSE(fit->is_trusted()) << fit->model.modes.front().freq_hz.value;
  EXPECT_FALSE(fit_second(stop(Spectrum{}), Axis::x, known));
}

TEST(Ringing, AfterAMoveTellsTheMode) {
  for (const auto& [mode_hz, damping_ratio] : {std::pair{30.0, 0.05}, std::pair{62.0, 0.09}}) {
    const Result<RecordFit> fit =
        fit_recording(stop_of_a_move(mode_hz, damping_ratio, 60.0), Axis::x, {});
    ASSERT_TRUE(fit) << mode_hz;
    EXPECT_EQ(fit->model.method, Method::ringing);
    EXPECT_NEAR(fit->model.modes.front().freq_hz.value, mode_hz, 0.01 * mode_hz);
    EXPECT_NEAR(fit->model.modes.front().damping_ratio.value, damping_ratio, 0.15 * damping_ratio);
    EXPECT_LT(fit->model.modes.front().freq_hz.low, mode_hz);
    EXPECT_GT(fit->model.modes.front().freq_hz.high, mode_hz);
  }
}

TEST(Ringing, WithoutMotionIsRefused) {
  Recording still{.rate_hz = 1344.0, .accel = {}};
  still.accel.fill(std::vector<double>(1000, 9.81));
  const Result<RecordFit> fit = fit_recording(still, Axis::x, {});
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().message, "there is no motion in it, or it is too short");
}

TEST(Ringing, ThatDrownsInNoiseIsRefusedOrDoubted) {
  Recording noise{.rate_hz = 1344.0, .accel = {}};
  std::mt19937 random(5);
  std::normal_distribution<double> chance;
  for (int i = 0; i < 1000; ++i) {
    noise.accel[0].push_back(chance(random));
    noise.accel[1].push_back(0.0);
    noise.accel[2].push_back(0.0);
  }
  const Result<RecordFit> fit = fit_recording(noise, Axis::x, {});
  EXPECT_TRUE(!fit || !fit->is_trusted());
}

// A stepper that runs on sounds at the frequency of its steps and does not die away.
TEST(Ringing, OfAMotorIsRefused) {
  for (const auto& [tone_hz, damping_ratio] : {std::pair{120.0, 0.002}, std::pair{200.0, 0.01}}) {
    const Result<RecordFit> fit =
        fit_recording(stop_of_a_move(tone_hz, damping_ratio, 5.0), Axis::x, {});
    ASSERT_TRUE(fit);
    EXPECT_THAT(fit->refusal, ::testing::HasSubstr("is no belt but a motor or a fan"));
  }
}

TEST(Tower, TellsFrequencyBySpacingAndDampingByDecay) {
  const double damping_ratio = 0.08;
  const double decay = std::exp(2.0 * std::numbers::pi * damping_ratio /
                                std::sqrt(1.0 - damping_ratio * damping_ratio));
  const Result<RecordFit> fit = fit_tower({.spacing_mm = 2.0,
                                           .spacing_spread_mm = 0.1,
                                           .speed_mm_s = 100.0,
                                           .decay = decay,
                                           .decay_spread = 0.1});
  ASSERT_TRUE(fit);
  EXPECT_DOUBLE_EQ(fit->model.modes.front().freq_hz.value, 50.0);
  EXPECT_NEAR(fit->model.modes.front().freq_hz.low, 50.0 * std::exp(-0.05), 1e-9);
  EXPECT_NEAR(fit->model.modes.front().damping_ratio.value, damping_ratio, 1e-12);
  EXPECT_LT(fit->model.modes.front().damping_ratio.low, damping_ratio);
  EXPECT_GT(fit->model.modes.front().damping_ratio.high, damping_ratio);
}

TEST(Tower, NeedsASpacingAndASpeed) {
  for (const Tower& tower : {Tower{.spacing_mm = 0.0, .speed_mm_s = 100.0},
                             Tower{.spacing_mm = 2.0, .speed_mm_s = -1.0}}) {
    const Result<RecordFit> fit = fit_tower(tower);
    ASSERT_FALSE(fit);
    EXPECT_EQ(fit.error().message, "the waves' spacing and the speed must be above 0");
  }
}

TEST(Tower, OfNoPrintersFrequencyIsRefused) {
  const Result<RecordFit> fit = fit_tower({.spacing_mm = 0.01, .speed_mm_s = 80.0});
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().message,
            "waves 0.01 mm apart at 80 mm/s are a frequency of 8000 Hz, which no printer's belts "
            "have; give the spacing in mm and the speed in mm/s");
}

TEST(Tower, WithoutDecayLeavesTheDampingAGuess) {
  const Result<RecordFit> fit = fit_tower({.spacing_mm = 2.0, .speed_mm_s = 100.0});
  ASSERT_TRUE(fit);
  EXPECT_THAT(fit->warnings, SizeIs(1));
  EXPECT_DOUBLE_EQ(fit->model.modes.front().damping_ratio.value, 0.1);
  EXPECT_FALSE(fit_tower({.spacing_mm = 2.0, .speed_mm_s = 100.0, .decay = 0.9}));
}

AxisModel measured(double freq_hz, double spread, std::vector<ModeOfAxis> others = {}) {
  AxisModel model;
  model.modes.push_back({.freq_hz = {freq_hz, freq_hz / (1.0 + spread), freq_hz * (1.0 + spread)},
                         .damping_ratio = {0.1, 0.08, 0.125}});
  std::vector<ModeOfAxis> modes = {{freq_hz, 0.1, 1.0}};
  for (const ModeOfAxis& other : others) {
    modes.front().gain -= other.gain;
    modes.push_back(other);
    model.modes.push_back({});
  }
  model.plants = {{.modes = modes, .share = 1.0}};
  const std::size_t rows = 3 * modes.size();
  model.covariance.assign(rows * rows, 0.0);
  for (std::size_t m = 0; m < modes.size(); ++m) {
    model.covariance[3 * m * (rows + 1)] = std::pow(std::log(1.0 + spread) / 1.96, 2);
    model.covariance[(3 * m + 1) * (rows + 1)] = 0.01;
  }
  return model;
}

TEST(Combined, RecordsWeighByTheirIntervals) {
  const AxisModel model = combine({measured(40.0, 0.001), measured(40.1, 0.1)});
  EXPECT_EQ(model.method, Method::combined);
  EXPECT_NEAR(model.modes.front().freq_hz.value, 40.0, 1e-3);
  EXPECT_LT(model.modes.front().freq_hz.high, 40.05);
}

TEST(Combined, RecordsThatDisagreeWidenTheIntervalAndThePlants) {
  const AxisModel alike = combine({measured(40.0, 0.01), measured(40.0, 0.01)});
  const AxisModel apart = combine({measured(40.0, 0.01), measured(44.0, 0.01)});
  const Estimate& narrow = alike.modes.front().freq_hz;
  EXPECT_LT(narrow.high / narrow.value, 1.01);
  const Estimate& wide = apart.modes.front().freq_hz;
  EXPECT_LT(wide.low, 40.1);
  EXPECT_GT(wide.high, 43.9);
  double lowest_hz = 1e3;
  double shares = 0.0;
  for (const Plant& plant : apart.plants) {
    lowest_hz = std::min(lowest_hz, plant.modes.front().freq_hz);
    shares += plant.share;
  }
  EXPECT_LT(lowest_hz, 40.1);
  EXPECT_NEAR(shares, 1.0, 1e-12);
}

TEST(Combined, RecordsAgreeIfTheirMainModesDo) {
  EXPECT_TRUE(agree({measured(40.0, 0.01), measured(41.0, 0.01)}));
  EXPECT_FALSE(agree({measured(40.0, 0.01), measured(40.5, 0.1), measured(43.0, 0.1)}));
}

TEST(Combined, ModesAreMatchedByFrequency) {
  const AxisModel first = measured(40.0, 0.01, {{80.0, 0.05, 0.3}});
  AxisModel second = measured(80.0, 0.01, {{41.0, 0.1, 0.7}});
  const AxisModel both = combine({first, second});
  ASSERT_THAT(both.values(), SizeIs(2));
  EXPECT_NEAR(both.values()[0].freq_hz, 40.5, 0.3);
  EXPECT_NEAR(both.values()[0].gain, 0.7, 1e-9);
  EXPECT_NEAR(both.values()[1].freq_hz, 80.0, 0.3);
}

TEST(Combined, RecordsOfOtherModesArePlants) {
  const AxisModel model = combine(
      {measured(40.0, 0.01), measured(40.5, 0.01), measured(41.0, 0.01, {{80.0, 0.05, 0.3}})});
  EXPECT_DOUBLE_EQ(model.values().front().freq_hz, 40.5);
  ASSERT_THAT(model.plants, SizeIs(3));
  EXPECT_NEAR(model.plants[0].share, 1.0 / 3.0, 1e-12);
  EXPECT_THAT(model.plants[2].modes, SizeIs(2));
  EXPECT_GE(model.modes.front().freq_hz.high, 41.0);
}

// The sensor's columns are turned against the printer's axes.
TEST(Ringing, IsReadHoweverTheSensorIsMounted) {
  Recording recording = stop_of_a_move(41.0, 0.05, 20.0);
  const std::vector<double> along = recording.accel[0];
  constexpr std::array<double, 3> kDirection = {0.2, -0.5, 0.843};
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < along.size(); ++i) {
      recording.accel[c][i] = kDirection[c] * along[i];
    }
  }
  const Result<RecordFit> fit = fit_recording(recording, Axis::x, {});
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->model.modes.front().freq_hz.value, 41.0, 0.1);
  for (std::size_t c = 0; c < 3; ++c) {
    EXPECT_NEAR(fit->direction[c], kDirection[c], 0.01);
  }
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
