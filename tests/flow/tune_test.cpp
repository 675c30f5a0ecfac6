// Calibration by printing, from end to end: a printer whose axes nobody knows prints the towers, an
// eye reads them, and what it reads goes into the next tower.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <string>

#include "tower_prints.hpp"
#include "unflex/tune/bands.hpp"

namespace unflex::flow {
namespace {

machine::Settings printer(const std::vector<std::string>& more = {}) {
  std::vector<std::string> overrides = {"printer.input_shaper_freq_x_hz=0",
                                        "printer.input_shaper_freq_y_hz=0"};
  overrides.insert(overrides.end(), more.begin(), more.end());
  return testing::tower_printer(overrides);
}

tune::TowerSettings tower_settings(const machine::Settings& settings,
                                   const std::array<tune::Knowledge, 2>& known) {
  tune::TowerSettings tower;
  tower.firmware = settings.printer.firmware;
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

std::array<tune::Knowledge, 2> tuned(const machine::Settings& settings, const tune::TrueAxes& axes,
                                     int rounds, double seen_um) {
  std::array<tune::Knowledge, 2> known;
  SilentProgress progress;
  for (int round = 0; round < rounds; ++round) {
    const tune::TowerSettings towers = tower_settings(settings, known);
    const tune::Tower tower = tune::tower(towers);
    const auto bands =
        tune::compensate_bands(tower, tune::settings_of_bands(towers, settings), 2, progress);
    EXPECT_TRUE(bands) << to_string(bands.error());
    const auto reliefs = tune::print_bands(*bands, tower, axes, progress);
    EXPECT_TRUE(reliefs) << to_string(reliefs.error());
    for (std::size_t axis = 0; axis < 2; ++axis) {
      std::vector<double> heights_um;
      for (std::size_t band = 0; band < towers.trials[axis].bands; ++band) {
        heights_um.push_back((*reliefs)[band][axis].height_um());
      }
      const tune::Zone zone = look(heights_um, seen_um);
      const Result<tune::Knowledge> next = tune::read(towers.trials[axis], zone);
      EXPECT_TRUE(next);
      known[axis] = *next;
    }
  }
  return known;
}

// UNFLEX_TUNE_MACHINES asks for more of them.
TEST(Tune, ThreeRoundsFindAxesThatNobodyKnows) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> freq_hz(25.0, 90.0);
  std::uniform_real_distribution<double> damping_ratio(0.03, 0.15);
  const char* const asked = std::getenv("UNFLEX_TUNE_MACHINES");
  const int machines = asked != nullptr ? std::atoi(asked) : 2;
  int right = 0;
  for (int machine = 0; machine < machines; machine += 2) {
    const tune::TrueAxes axes{{freq_hz(random), freq_hz(random)},
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

// A tower of three bands that are all made for the same, so that one model verifies them all.
tune::TowerSettings even_tower(const machine::Settings& settings) {
  tune::TowerSettings towers = tower_settings(settings, {});
  for (std::size_t axis = 0; axis < towers.trials.kCount; ++axis) {
    tune::Trial& trial = towers.trials[axis];
    trial = tune::next_trial({.freq_hz = 45.0, .freq_error = 0.02, .damping_ratio = 0.06},
                             towers.accel_mm_s2);
    trial.bands = 3;
    trial.first = 45.0;
    trial.step = 1.0;
  }
  return towers;
}

TEST(Tune, BandsMakeOnePrintThatBreaksNoRule) {
  for (const std::vector<std::string>& firmware :
       {std::vector<std::string>{}, {"printer.firmware=marlin"}, {"printer.firmware=rrf"}}) {
    const machine::Settings settings = printer(firmware);
    const tune::TowerSettings towers = even_tower(settings);
    const tune::Tower tower = tune::tower(towers);
    SilentProgress progress;
    const auto bands =
        tune::compensate_bands(tower, tune::settings_of_bands(towers, settings), 2, progress);
    ASSERT_TRUE(bands) << to_string(bands.error());
    const Result<report::Report> report = testing::verify_joined(tower, *bands);
    ASSERT_TRUE(report) << to_string(report.error());
    EXPECT_EQ(report->violation_count, 0U) << testing::complaints(*report);
    // One run for each layer of the base, and one for each of the bands'.
    EXPECT_EQ(report->runs.compensated, 4U + 3U * towers.layers_per_band);
    EXPECT_LT(report->measured.compensated.extruding.contour_rms_mm,
              0.3 * report->measured.uncompensated.extruding.contour_rms_mm);
  }
}

TEST(Tune, GivesTheSameForAnyNumberOfThreads) {
  const machine::Settings settings = printer();
  const tune::TowerSettings towers = even_tower(settings);
  const tune::Tower tower = tune::tower(towers);
  SilentProgress progress;
  const auto one =
      tune::compensate_bands(tower, tune::settings_of_bands(towers, settings), 1, progress);
  const auto three =
      tune::compensate_bands(tower, tune::settings_of_bands(towers, settings), 3, progress);
  ASSERT_TRUE(one && three);
  EXPECT_EQ(tune::join_bands(*one), tune::join_bands(*three));
}

TEST(Tune, RefusesAPrinterThatCannotBeCompensated) {
  machine::Settings settings = printer();
  settings.refusal = Diagnostic{{"p.toml", 3}, "this firmware caps limits"};
  const tune::TowerSettings towers = even_tower(settings);
  SilentProgress progress;
  const auto bands = tune::compensate_bands(tune::tower(towers),
                                            tune::settings_of_bands(towers, settings), 1, progress);
  ASSERT_FALSE(bands);
  EXPECT_EQ(bands.error().message, "this firmware caps limits");
}

TEST(Tune, RefusesABandThatStaysAsSliced) {
  // The printer takes far fewer lines per second than the waves have.
  const machine::Settings settings = printer({"emit.max_lines_per_s=12"});
  const tune::TowerSettings towers = even_tower(settings);
  SilentProgress progress;
  const auto bands = tune::compensate_bands(tune::tower(towers),
                                            tune::settings_of_bands(towers, settings), 1, progress);
  ASSERT_FALSE(bands);
  EXPECT_EQ(bands.error().kind, ErrorKind::usage);
  EXPECT_NE(bands.error().message.find("stays as sliced"), std::string::npos)
      << bands.error().message;
}

}  // namespace
}  // namespace unflex::flow
