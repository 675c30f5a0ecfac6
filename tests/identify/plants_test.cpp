// The plants that are written beside an estimate.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "unflex/identify/axis_model.hpp"

namespace unflex::identify {
namespace {

using Modes = std::vector<ModeOfAxis>;

// From base to nozzle.
std::complex<double> response(const Modes& modes, double freq_hz) {
  std::complex<double> sum;
  for (const ModeOfAxis& mode : modes) {
    const double s = freq_hz / mode.freq_hz;
    const std::complex<double> damped(0.0, 2.0 * mode.damping_ratio * s);
    sum += mode.gain * (1.0 + damped) / (1.0 - s * s + damped);
  }
  return sum;
}

// How far apart two nozzles swing for a base of even speed, against how far one swings.
double apart(const Modes& a, const Modes& b, const Modes& of) {
  double difference = 0.0;
  double swing = 0.0;
  for (double freq_hz = 12.0; freq_hz <= 131.0; freq_hz += 1.0) {
    difference += std::norm((response(a, freq_hz) - response(b, freq_hz)) / freq_hz);
    swing += std::norm((response(of, freq_hz) - 1.0) / freq_hz);
  }
  return std::sqrt(difference / swing);
}

TEST(OtherPlants, HaveModesInCommonWhereItMakesNoDifference) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::size_t own = 0;
  std::size_t different = 0;
  for (int trial = 0; trial < 50; ++trial) {
    // The main mode is open by some per cent. A minor one hardly counts, wherever it is.
    const Modes estimate = {{48.0, 0.08, 0.85}, {90.0, 0.06, 0.1}, {165.0, 0.04, 0.05}};
    AxisModel model;
    model.plants = {{estimate, 0.4}};
    for (int i = 0; i < 6; ++i) {
      Modes modes = estimate;
      modes[0].freq_hz *= std::exp(0.03 * normal(random));
      modes[1].freq_hz *= std::exp(0.01 * normal(random));
      modes[2].freq_hz *= std::exp(0.05 * normal(random));
      modes[2].damping_ratio *= std::exp(0.3 * normal(random));
      model.plants.push_back({modes, 0.1});
    }
    const std::vector<Plant> others = other_plants(model);
    ASSERT_EQ(others.size(), 6U);
    std::set<double> frequencies;
    for (const Plant& plant : others) {
      const auto from = std::ranges::find_if(model.plants, [&](const Plant& given) {
        return given.modes[0].gain == plant.modes[0].gain &&
               apart(given.modes, plant.modes, estimate) < 0.101;
      });
      EXPECT_NE(from, model.plants.end()) << "a plant that nobody asked for";
      ASSERT_EQ(plant.modes.size(), 3U);
      for (std::size_t mode = 0; mode < 3; ++mode) {
        EXPECT_EQ(plant.modes[mode].gain, estimate[mode].gain);
        frequencies.insert(plant.modes[mode].freq_hz);
      }
    }
    different += frequencies.size();
    own += 3 * others.size();
  }
  EXPECT_LT(different, 3 * own / 5);
  // The main modes stay apart.
  EXPECT_GT(different, 50U * 3U);
}

}  // namespace
}  // namespace unflex::identify
