// Calibration of pressure by printing, from end to end: a hotend that nobody knows prints the
// towers, an eye reads them, and what it reads goes into the next tower.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "tower_prints.hpp"

namespace unflex::flow {
namespace {

tune::PressureTowerSettings tower_settings(const machine::Settings& settings,
                                           const tune::PressureKnowledge& known) {
  tune::PressureTowerSettings tower;
  tower.firmware = settings.printer.firmware;
  tower.accel_mm_s2 = settings.limits.max_accel_mm_s2;
  tower.trial = tune::next_trial(known);
  tower.accel_mm_s2 =
      std::min(tower.accel_mm_s2,
               tune::followed_accel_mm_s2(tower, settings.pressure.max_extruder_accel_mm_s2));
  tower.layers_per_band = 2;
  tower.codes = {"G28\nM109 S200\n", "M104 S0\n", 110.0, 105.0};
  return tower;
}

// What an eye tells that sees a tenth of the width: the row around the best band in which it sees
// nothing. If it sees something everywhere, the bands that are hardly worse than the best.
tune::Zone look(const std::vector<double>& seen) {
  constexpr double kSeen = 0.1;
  const auto best = static_cast<std::size_t>(std::ranges::min_element(seen) - seen.begin());
  const double limit = std::max(kSeen, 1.05 * seen[best]);
  std::size_t first = best;
  std::size_t last = best;
  while (first > 0 && seen[first - 1] <= limit) {
    --first;
  }
  while (last + 1 < seen.size() && seen[last + 1] <= limit) {
    ++last;
  }
  return {first + 1, last + 1};
}

// The bands around the one that is nearest to the hotend's own: those farther away show more.
tune::PressureTrial near(const tune::PressureTrial& trial, const tune::TrueHotend& hotend) {
  constexpr std::size_t kAround = 6;
  const double own_s = trial.parameter == tune::PressureParameter::sum
                           ? hotend.advance_s + hotend.dead_time_s
                           : hotend.dead_time_s;
  std::size_t nearest = 1;
  for (std::size_t band = 1; band <= trial.bands; ++band) {
    if (std::abs(trial.value_s(band) - own_s) < std::abs(trial.value_s(nearest) - own_s)) {
      nearest = band;
    }
  }
  const std::size_t first = nearest > kAround ? nearest - kAround : 1;
  tune::PressureTrial result = trial;
  result.first_s = trial.value_s(first);
  result.bands = std::min(nearest + kAround, trial.bands) - first + 1;
  return result;
}

tune::PressureKnowledge tuned(const machine::Settings& settings, const tune::TrueHotend& hotend,
                              int rounds, bool with_all_bands) {
  tune::PressureKnowledge known;
  SilentProgress progress;
  for (int round = 0; round < rounds; ++round) {
    tune::PressureTowerSettings towers = tower_settings(settings, known);
    if (!with_all_bands) {
      towers.trial = near(towers.trial, hotend);
    }
    const tune::Tower tower = tune::tower(towers);
    const auto bands =
        tune::compensate_bands(tower, tune::settings_of_bands(towers, settings), 2, progress);
    EXPECT_TRUE(bands) << to_string(bands.error());
    const auto widths = tune::print_bands(*bands, hotend, progress);
    EXPECT_TRUE(widths) << to_string(widths.error());
    std::vector<double> seen;
    for (const tune::RingWidths& ring : *widths) {
      seen.push_back(ring.seen());
    }
    const tune::Zone zone = look(seen);
    const auto next = tune::read(towers.trial, zone);
    EXPECT_TRUE(next);
    known = *next;
  }
  return known;
}

// UNFLEX_TUNE_HOTENDS asks for more of them, and for all bands.
TEST(TunePressure, FourRoundsFindAHotendThatNobodyKnows) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> log_advance(std::log(0.02), std::log(0.8));
  std::uniform_real_distribution<double> dead_time_s(0.0, 0.008);
  const char* const asked = std::getenv("UNFLEX_TUNE_HOTENDS");
  const int hotends = asked != nullptr ? std::atoi(asked) : 1;
  int right = 0;
  for (int i = 0; i < hotends; ++i) {
    const double advance_s = std::exp(log_advance(random));
    const tune::TrueHotend hotend{advance_s, dead_time_s(random)};
    const tune::PressureKnowledge known =
        tuned(testing::tower_printer({}), hotend, 4, asked != nullptr);
    const double off = known.advance_s() / hotend.advance_s - 1.0;
    const double late_ms = 1e3 * (known.dead_time_s - hotend.dead_time_s);
    fmt::print("K {:.4f} s, {:.2f} ms: off by {:+.2f} %, {:+.2f} ms\n", hotend.advance_s,
               1e3 * hotend.dead_time_s, 100.0 * off, late_ms);
    right += std::abs(off) < 0.05 && std::abs(late_ms) < 1.0 ? 1 : 0;
  }
  EXPECT_GE(right, 0.95 * hotends);
}

// Joined, each band still sets what it was made for, and the printer has its own back.
TEST(TunePressure, BandsMakeOnePrintThatBreaksNoRule) {
  for (const std::vector<std::string>& firmware :
       {std::vector<std::string>{}, {"printer.firmware=marlin"}, {"printer.firmware=rrf"}}) {
    const machine::Settings settings = testing::tower_printer(firmware);
    tune::PressureTowerSettings towers = tower_settings(settings, {.sum_s = 0.05, .rounds = 1});
    towers.trial.bands = 2;
    towers.trial.first_s = 0.05;
    towers.trial.step = 1e-9;  // so that the settings of one band verify both
    towers.own_advance_s = 0.03;
    const tune::Tower tower = tune::tower(towers);
    SilentProgress progress;
    const auto bands =
        tune::compensate_bands(tower, tune::settings_of_bands(towers, settings), 2, progress);
    ASSERT_TRUE(bands) << to_string(bands.error());
    const Result<report::Report> report = testing::verify_joined(tower, *bands);
    ASSERT_TRUE(report) << to_string(report.error());
    EXPECT_EQ(report->violation_count, 0U) << testing::complaints(*report);
    EXPECT_EQ(report->runs.fallback, 0U);
    ASSERT_TRUE(report->measured.uncompensated.line.is_known());
    EXPECT_LT(report->measured.compensated.line.width.rms, 0.05);
  }
}

}  // namespace
}  // namespace unflex::flow
