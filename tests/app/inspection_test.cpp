#include "inspection.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "paths.hpp"
#include "report/documented_keys.hpp"

namespace unflex::app {
namespace {

using ::testing::HasSubstr;

flow::Inspection sample() {
  flow::Inspection i;
  i.dialect = "PrusaSlicer 2.5.0";
  i.counts.lines = 21912;
  i.counts.bytes = 790000;
  i.counts.moves = 16835;
  i.counts.extruding_moves = 15000;
  i.counts.extrude_only_moves = 754;
  i.counts.arcs = 3;
  i.counts.passive_lines = 11;
  i.counts.limit_lines = 12;
  i.counts.barrier_lines = 13;
  i.commands = {{"G1", 18000}, {"M204", 12}};
  i.runs = 400;
  i.windows = 410;
  i.run_time_s = 2400.0;
  i.kept_moves = {{"Z move", 200}};
  i.extruded_path = {8000.0, 7900.0, {{"start unknown", 100.0}}};
  i.unknown_commands = {{"M1234", 40, 12, 7, 100.0}};
  i.reference_time_s = 2488.0;
  i.moving_time_s = 2450.0;
  i.filament_mm = 1234.5;
  i.path_length_mm = 99999.0;
  i.max_mm.x = 120.0;
  i.absolute_e = true;
  i.lowest_accel_mm_s2 = 500.0;
  i.highest_accel_mm_s2 = 1500.0;
  i.limits = {{"limits.print_accel_mm_s2", {1250.0, 7, 3}}};
  i.step_rates.motors = {{"X", 80.0, 24000.0, 30}};
  i.step_rates.total = {"", 0.0, 24000.0, 30};
  i.warnings = {"in.gcode:3: warning: something"};
  return i;
}

TEST(InspectionText, ShowsWhatWasUnderstood) {
  const std::string text = inspection_text(sample(), "in.gcode", machine::Settings{}, true);
  EXPECT_THAT(text, ::testing::StartsWith("in.gcode\ndialect       PrusaSlicer 2.5.0\n"));
  EXPECT_THAT(text, HasSubstr("16835, 15000 extruding, 754 of filament alone, 3 arcs"));
  EXPECT_THAT(text, HasSubstr("print time    41m 28s, 40m 50s of it moving"));
  EXPECT_THAT(text, HasSubstr("400 in 410 windows, 40m 00s can be compensated"));
  EXPECT_THAT(text, HasSubstr("200 moves stay as they are: Z move"));
  EXPECT_THAT(text, HasSubstr("98.7 % of 8000 mm extruded can be compensated\n"));
  EXPECT_THAT(text, HasSubstr("\nunknown       M1234, 40×, first in line 12: 7 moves"));
  EXPECT_THAT(text, HasSubstr("\nstep rates    X 24.0 (line 30) kHz at most\n"));
  EXPECT_THAT(text, HasSubstr("500 to 1500 mm/s²"));
  EXPECT_THAT(text, HasSubstr("X 45 Hz, ζ 0.06"));
}

TEST(InspectionText, FoldsWhatIsAtItsDefault) {
  const auto settings =
      machine::parse("[limits]\nmax_accel_mm_s2 = 3000\n", "p.toml", {"base.max_accel_mm_s2=9000"});
  ASSERT_TRUE(settings);
  const std::string text = inspection_text(sample(), "in.gcode", *settings, false);
  EXPECT_THAT(text, ::testing::ContainsRegex("\n  limits.max_accel_mm_s2 +3000 +p.toml:2\n"));
  EXPECT_THAT(text, ::testing::ContainsRegex("\n  base.max_accel_mm_s2 +9000 +--set\n"));
  EXPECT_THAT(text, ::testing::Not(HasSubstr("base.max_velocity_mm_s")));
  const std::size_t folded = machine::rows(*settings).size() - 2;
  EXPECT_THAT(text, HasSubstr(std::to_string(folded) + " more are at their default; --all lists"));
}

TEST(InspectionText, ShowsEveryValueAndWhereItIsFrom) {
  const auto settings =
      machine::parse("[limits]\nmax_accel_mm_s2 = 3000\n", "p.toml", {"base.max_accel_mm_s2=9000"});
  ASSERT_TRUE(settings);
  const std::string text = inspection_text(sample(), "in.gcode", *settings, true);
  EXPECT_THAT(text, ::testing::ContainsRegex("\n  limits.max_accel_mm_s2 +3000 +p.toml:2\n"));
  EXPECT_THAT(text, ::testing::ContainsRegex("\n  base.max_accel_mm_s2 +9000 +--set\n"));
  EXPECT_THAT(text, ::testing::ContainsRegex("\n  base.max_velocity_mm_s +600 +default\n"));
  EXPECT_THAT(text, ::testing::ContainsRegex(
                        "\n  limits.print_accel_mm_s2 +1250 +in.gcode:7, the first of 3 times\n"));
  for (const machine::SettingRow& row : machine::rows(*settings)) {
    EXPECT_THAT(text, HasSubstr("\n  " + row.key + " "));
  }
}

TEST(InspectionJson, HoldsThePrintTimeAndTheSettings) {
  const auto json =
      nlohmann::json::parse(inspection_json(sample(), "in.gcode", *machine::load({}, {})));
  EXPECT_EQ(json["print_time_s"]["reference"], 2488.0);
  EXPECT_EQ(json["moves"]["extruding"], 15000);
  EXPECT_EQ(json["commands"]["M204"], 12);
  EXPECT_EQ(json["extruded_path"]["compensated_share"], 0.9875);
  EXPECT_EQ(json["unknown_commands"][0]["command"], "M1234");
  EXPECT_EQ(json["printer"]["emit.period_ms"]["value"], 1);
  EXPECT_EQ(json["printer"]["emit.period_ms"]["origin"], "default");
}

TEST(ReportPage, DocumentsExactlyTheKeysOfAnInspection) {
  const auto json =
      nlohmann::json::parse(inspection_json(sample(), "in.gcode", *machine::load({}, {})));
  std::set<std::string> keys;
  report::collect_keys(json, "", keys);
  EXPECT_EQ(report::documented_keys(std::string(test_paths::kDocs) + "/report.md", "inspect"),
            keys);
}

}  // namespace
}  // namespace unflex::app
