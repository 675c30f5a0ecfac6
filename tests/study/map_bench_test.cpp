// The bench of places.
#include "unflex/study/map_bench.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "paths.hpp"
#include "report/documented_keys.hpp"
#include "unflex/study/case.hpp"

namespace unflex::study {
namespace {

using ::testing::HasSubstr;

MapPlace place_at(double x_mm, double freq_hz) {
  Case of;
  of.axis = dynamics::from_frequency(freq_hz, 0.06);
  MapPlace place{{x_mm, 0.0}, corner_setup(of).unflex};
  place.unflex.x.limits.max_accel_mm_s2 = place.unflex.y.limits.max_accel_mm_s2 = 20000.0;
  return place;
}

MapOutcome measured(const std::vector<double>& freq_hz) {
  std::vector<MapPlace> places;
  for (const double hz : freq_hz) {
    places.push_back(place_at(100.0 * static_cast<double>(places.size()), hz));
  }
  MapBench bench(std::move(places), {.ipopt = false, .workers = 2});
  const Run run{corner({}, 5000.0), {}};
  bench.add({run, run});
  MapOutcome outcome = bench.outcome();
  outcome.input = "print.gcode";
  return outcome;
}

TEST(MapBench, TunesEachShaperToTheWholeBed) {
  const MapOutcome outcome = measured({45.0, 42.0, 39.0});
  ASSERT_EQ(outcome.contenders.size(), 6U);
  EXPECT_EQ(outcome.contenders.front().name, "as sliced");
  EXPECT_EQ(outcome.unflex().name, "unflex");
  EXPECT_EQ(outcome.failed_runs, 0U);
  for (const MapContender& contender : outcome.contenders) {
    ASSERT_EQ(contender.rms_mm.size(), 3U);
  }
  for (std::size_t i = 1; i + 1 < outcome.contenders.size(); ++i) {
    EXPECT_GE(outcome.contenders[i].freq_hz.x, 0.9 * 39.0 - 1e-9);
    EXPECT_LE(outcome.contenders[i].freq_hz.x, 1.4 * 45.0 + 1e-9);
  }
  // ZV is best at the frequency that it is tuned to, so it is tuned between the two ends.
  const MapContender& zv = outcome.contenders[1];
  EXPECT_EQ(zv.name, "ZV");
  EXPECT_GT(zv.freq_hz.x, 39.0);
  EXPECT_LT(zv.freq_hz.x, 45.0);
  EXPECT_LE(outcome.unflex().worst_mm(), 0.3 * outcome.best_shaper().worst_mm());
}

TEST(MapBench, IsTheSameAtPlacesThatAreAlike) {
  const MapOutcome outcome = measured({45.0, 45.0});
  for (const MapContender& contender : outcome.contenders) {
    EXPECT_EQ(contender.rms_mm[0], contender.rms_mm[1]) << contender.name;
  }
}

TEST(MapReport, IsDocumentedAndNamesEachContender) {
  MapOutcome outcome = measured({45.0, 40.0});
  outcome.printer.push_back({"limits.max_accel_mm_s2", "5000", "default"});
  std::set<std::string> keys;
  report::collect_keys(nlohmann::json::parse(to_json(outcome)), "", keys);
  EXPECT_EQ(report::documented_keys(std::string(test_paths::kDocs) + "/report.md", "study --map"),
            keys);
  const std::string text = to_text(outcome);
  for (const MapContender& contender : outcome.contenders) {
    EXPECT_THAT(text, HasSubstr(contender.name));
  }
  EXPECT_THAT(text, HasSubstr("X100 Y0: 40.0, 40.0 Hz"));
  EXPECT_THAT(text, HasSubstr("of what the best shaper"));
}

}  // namespace
}  // namespace unflex::study
