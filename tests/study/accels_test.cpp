// A print at several accelerations: its own commands scaled, the choice, and the reports.
#include "unflex/study/accels.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "paths.hpp"
#include "report/documented_keys.hpp"

namespace unflex::study {
namespace {

using ::testing::HasSubstr;

TEST(ScaledAccels, AreThoseOfThePrintAlone) {
  EXPECT_EQ(with_scaled_accels("M204 S800", 2.5), "M204 S2000");
  EXPECT_EQ(with_scaled_accels("  m204 P500 R1000\tT600.5 ; S100\r", 2.0),
            "  m204 P1000 R1000\tT1201 ; S100\r");
  EXPECT_EQ(
      with_scaled_accels("SET_VELOCITY_LIMIT ACCEL=3000 VELOCITY=200 accel_to_decel=1500 S=5", 2.0),
      "SET_VELOCITY_LIMIT ACCEL=6000 VELOCITY=200 accel_to_decel=3000 S=5");
  for (const char* line :
       {"M204", "M205 S5", "G1 X5 S800", "; M204 S800", "M204 S", "", "M2040 S1", "M204 ;S800"}) {
    EXPECT_EQ(with_scaled_accels(line, 2.0), line);
  }
}

AtAccel at(double accel_mm_s2, double time_s, double rms_mm) {
  AtAccel one;
  one.accel_mm_s2 = accel_mm_s2;
  one.sliced_time_s = time_s - 0.5;
  one.time_s = time_s;
  one.sliced.contour_rms_mm = 10.0 * rms_mm;
  one.compensated.contour_rms_mm = rms_mm;
  return one;
}

AccelsOutcome outcome_of(std::optional<double> keep_rms_mm) {
  AccelsOutcome outcome;
  outcome.input = "print.gcode";
  outcome.printer.push_back({"limits.max_accel_mm_s2", "5000", "default"});
  outcome.accels = {at(2500.0, 20.0, 0.001), at(10000.0, 12.0, 0.004), at(5000.0, 15.0, 0.002)};
  outcome.keep_rms_mm = keep_rms_mm;
  return outcome;
}

TEST(Accels, TheFastestThatKeepsTheRmsIsNamed) {
  EXPECT_EQ(outcome_of(0.002).fastest_kept()->accel_mm_s2, 5000.0);
  EXPECT_EQ(outcome_of(0.1).fastest_kept()->accel_mm_s2, 10000.0);
  EXPECT_EQ(outcome_of(0.0005).fastest_kept(), nullptr);
  EXPECT_EQ(outcome_of(std::nullopt).fastest_kept(), nullptr);
  EXPECT_THAT(to_text(outcome_of(0.002)),
              HasSubstr("RMS of 2.00 µm: kept fastest at 5000 mm/s², in 15.00 s\n"));
  EXPECT_THAT(to_text(outcome_of(0.0005)), HasSubstr("none of them keeps it\n"));
}

TEST(AccelsReport, IsDocumented) {
  std::set<std::string> keys;
  report::collect_keys(nlohmann::json::parse(to_json(outcome_of(0.002))), "", keys);
  EXPECT_EQ(report::documented_keys(std::string(test_paths::kDocs) + "/report.md", "study --accel"),
            keys);
  const auto json = nlohmann::json::parse(to_json(outcome_of(std::nullopt)));
  EXPECT_EQ(json["kept_max_accel_mm_s2"], nullptr);
  EXPECT_EQ(json["accels"][1]["compensated"]["contour_rms_mm"], 0.004);
}

}  // namespace
}  // namespace unflex::study
