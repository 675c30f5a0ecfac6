// Calibration by printing, from end to end: a printer whose axes nobody knows prints the towers, an
// eye reads them, and what it reads goes into the next tower.
#include "unflex/pipeline/tune.hpp"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>

namespace unflex::pipeline {
namespace {

machine::Settings printer(const std::vector<std::string>& more = {}) {
  std::vector<std::string> overrides = {"printer.firmware=klipper", "dynamics.x.freq_hz=45",
                                        "dynamics.y.freq_hz=45", "printer.input_shaper_freq_x_hz=0",
                                        "printer.input_shaper_freq_y_hz=0"};
  overrides.insert(overrides.end(), more.begin(), more.end());
  Result<machine::Settings> settings = machine::load(std::nullopt, overrides);
  EXPECT_TRUE(settings) << to_string(settings.error());
  return *settings;
}

tune::TowerSettings tower_settings(const machine::Settings& settings,
                                   const std::array<tune::Knowledge, 2>& known) {
  tune::TowerSettings tower;
  tower.accel_mm_s2 = settings.limits.max_accel_mm_s2;
  tower.trials = {tune::next_trial(known[0], tower.accel_mm_s2),
                  tune::next_trial(known[1], tower.accel_mm_s2)};
  tower.layers_per_band = 2;
  tower.codes = {"G28\nM109 S200\n", "M104 S0\n", 110.0, 105.0};
  return tower;
}

// What an eye tells of the walls of one axis: the longest row of bands whose waves it does not see.
// If it sees waves everywhere, the bands that are hardly worse than the best.
tune::Zone look(const std::vector<double>& heights_um, double seen_um) {
  double least_um = heights_um.front();
  for (const double height_um : heights_um) {
    least_um = std::min(least_um, height_um);
  }
  const double limit_um = std::max(seen_um, 1.2 * least_um);
  tune::Zone best;
  tune::Zone zone;
  for (std::size_t band = 1; band <= heights_um.size(); ++band) {
    if (heights_um[band - 1] > limit_um) {
      zone = {};
      continue;
    }
    zone = {zone.first == 0 ? band : zone.first, band};
    if (best.first == 0 || zone.last - zone.first > best.last - best.first) {
      best = zone;
    }
  }
  return best;
}

std::array<tune::Knowledge, 2> tuned(const machine::Settings& settings, const TrueAxes& axes,
                                     int rounds, double seen_um) {
  std::array<tune::Knowledge, 2> known;
  SilentProgress progress;
  const bool says = std::getenv("UNFLEX_TUNE_SAYS") != nullptr;
  for (int round = 0; round < rounds; ++round) {
    const tune::TowerSettings towers = tower_settings(settings, known);
    const tune::Tower tower = tune::tower(towers);
    const auto bands = compensate_bands(tower, towers, settings, 2, progress);
    EXPECT_TRUE(bands) << to_string(bands.error());
    const auto reliefs = print_bands(*bands, tower, axes, progress);
    EXPECT_TRUE(reliefs) << to_string(reliefs.error());
    for (std::size_t axis = 0; axis < 2; ++axis) {
      std::vector<double> heights_um;
      for (std::size_t band = 0; band < towers.trials[axis].bands; ++band) {
        heights_um.push_back((*reliefs)[band][axis].height_um());
      }
      const tune::Zone zone = look(heights_um, seen_um);
      if (says) {
        fmt::print("axis {} true {:.2f} {:.3f} side {} waves {} accel {:.0f} zone {}..{} of {}:",
                   axis, axes.freq_hz[axis], axes.damping_ratio[axis], tower.side_mm,
                   towers.trials[axis].waves.count, towers.trials[axis].waves.accel_mm_s2,
                   zone.first, zone.last, heights_um.size());
        for (std::size_t band = 0; band < heights_um.size(); ++band) {
          fmt::print(" {:.4g}:{:.1f}", towers.trials[axis].value(band + 1), heights_um[band]);
        }
      }
      const Result<tune::Knowledge> next = tune::read(towers.trials[axis], zone);
      EXPECT_TRUE(next);
      known[axis] = *next;
      if (says) {
        fmt::print("\n  -> {:.2f} +- {:.1f} %, {:.4f} +- {:.4f}\n", next->freq_hz,
                   100 * next->freq_error, next->damping_ratio, next->damping_error);
      }
    }
  }
  return known;
}

TEST(Tune, ThreeRoundsFindAxesThatNobodyKnows) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> freq_hz(25.0, 90.0);
  std::uniform_real_distribution<double> damping_ratio(0.03, 0.15);
  const char* const asked = std::getenv("UNFLEX_TUNE_MACHINES");
  const int machines = asked != nullptr ? std::atoi(asked) : 4;
  int right = 0;
  for (int machine = 0; machine < machines; machine += 2) {
    const TrueAxes axes{{freq_hz(random), freq_hz(random)},
                        {damping_ratio(random), damping_ratio(random)}};
    const auto known = tuned(printer(), axes, 3, 8.0);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double off = known[axis].freq_hz / axes.freq_hz[axis] - 1.0;
      fmt::print("{:.2f} Hz {:.3f}: off by {:+.2f} %, {:+.4f}\n", axes.freq_hz[axis],
                 axes.damping_ratio[axis], 100.0 * off,
                 known[axis].damping_ratio - axes.damping_ratio[axis]);
      right += std::abs(off) < 0.01 ? 1 : 0;
    }
  }
  EXPECT_GE(right, 0.95 * machines);
}

}  // namespace
}  // namespace unflex::pipeline
