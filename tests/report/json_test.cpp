#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "paths.hpp"
#include "report/documented_keys.hpp"
#include "report/sample_report.hpp"

namespace unflex::report {
namespace {

nlohmann::json parsed(const Report& report) { return nlohmann::json::parse(to_json(report)); }

TEST(JsonReport, HasEveryValueUnderItsKey) {
  const nlohmann::json json = parsed(sample_report());
  EXPECT_EQ(json["schema_version"], 1);
  EXPECT_EQ(json["command"], "compensate");
  EXPECT_EQ(json["input"], "cube.gcode");
  EXPECT_EQ(json["output"], "out.gcode");
  EXPECT_EQ(json["firmware"], "klipper");
  EXPECT_EQ(json["print_time_s"], (nlohmann::json{{"reference", 3600.0}, {"emitted", 3618.0}}));
  EXPECT_EQ(json["base"], (nlohmann::json{{"max_velocity_mm_s", 123.0},
                                          {"max_accel_mm_s2", 19999.0},
                                          {"max_step_mm_s", 27.5},
                                          {"accel_limit_mm_s2", 20000.0},
                                          {"own_max_velocity_mm_s", 300.0},
                                          {"own_max_accel_mm_s2", 8000.0},
                                          {"own_max_accel_origin", "--set"}}));
  EXPECT_EQ(json["windows"], (nlohmann::json{{"total", 1000}, {"solved", 994}, {"fallback", 6}}));
  EXPECT_EQ(json["runs"], (nlohmann::json{{"total", 900}, {"compensated", 895}, {"fallback", 5}}));
  EXPECT_EQ(json["kept_moves"], (nlohmann::json{{"Z move", 12}}));
  EXPECT_EQ(json["solver"], (nlohmann::json{{"engine", "ipopt 3.11.9"},
                                            {"iterations", 4242},
                                            {"checked_windows", 8},
                                            {"largest_gap", 3e-9},
                                            {"largest_difference_mm", 2e-6}}));
  EXPECT_EQ(json["output_stats"], (nlohmann::json{{"lines", 123456},
                                                  {"bytes", 4500000},
                                                  {"max_lines_per_s", 890.0},
                                                  {"segment_ms_median", 2.5},
                                                  {"worst_run_drift_ms", 0.04}}));
  EXPECT_EQ(json["extrusion"], (nlohmann::json{{"input_mm", 1234.5},
                                               {"output_mm", 1234.75},
                                               {"worst_move_error_mm", 0.00001},
                                               {"lag_rms_mm", 0.0045},
                                               {"lag_max_mm", 0.035},
                                               {"lag_max_line", 801},
                                               {"uncompensated_lag_rms_mm", 0.06},
                                               {"uncompensated_lag_max_mm", 0.5},
                                               {"uncompensated_lag_max_line", 700}}));
  EXPECT_EQ(json["performance"], (nlohmann::json{{"wall_s", 90.0},
                                                 {"cpu_s", 170.0},
                                                 {"print_s_per_wall_s", 40.0},
                                                 {"peak_rss_mb", 64.0}}));
  EXPECT_EQ(json["violation_count"], 3);
  EXPECT_EQ(json["violations"], nlohmann::json::array({"out.gcode:7: outside the travel"}));
  EXPECT_EQ(json["warnings"], nlohmann::json::array({"cube.gcode:1: warning: no G28"}));
}

TEST(JsonReport, AnswersWhatTheSummaryAnswers) {
  Report report = sample_report();
  const nlohmann::json answers = parsed(report)["answers"];
  EXPECT_EQ(answers["better"]["now"], "under the printer's own input shaper, MZV 45 Hz");
  EXPECT_EQ(answers["better"]["exact"],
            (nlohmann::json{
                {"now_rms_mm", 0.2}, {"compensated_rms_mm", 0.003125}, {"zv_rms_mm", nullptr}}));
  EXPECT_EQ(answers["better"]["off_by_5_percent"]["compensated_rms_mm"], 0.0061);
  EXPECT_EQ(answers["worst"]["compensated"]["line"], 41);
  EXPECT_EQ(answers["worst"]["compensated"]["layer"], 1);
  EXPECT_EQ(answers["worst"]["now"]["contour_max_mm"], 0.8);
  EXPECT_EQ(answers["worst"]["now"]["feature"], "Perimeter");
  EXPECT_EQ(answers["start_now_max_mm"], 0.9);
  EXPECT_EQ(answers["safe"]["is_safe"], false);
  EXPECT_NEAR(answers["safe"]["times_own_accel"].get<double>(), 19999.0 / 8000.0, 1e-12);

  // Without a shaper of its own the print is compared with ZV as well.
  report.measured.unshaped = std::nullopt;
  report.facts.shaper.clear();
  const nlohmann::json better = parsed(report)["answers"]["better"];
  EXPECT_EQ(better["now"], "without an input shaper");
  EXPECT_EQ(better["exact"]["zv_rms_mm"], 0.004);
  EXPECT_EQ(better["off_by_5_percent"]["zv_rms_mm"], 0.009);
}

TEST(JsonReport, TellsOfEachShaper) {
  const nlohmann::json contenders = parsed(sample_report())["contenders"];
  ASSERT_EQ(contenders.size(), 4U);
  EXPECT_EQ(contenders[2]["name"], "ZV");
  EXPECT_EQ(contenders[2]["errors"][0],
            (nlohmann::json{
                {"frequency_error", -0.05}, {"contour_rms_mm", 0.008}, {"contour_max_mm", 0.03}}));
  EXPECT_EQ(contenders[2]["corner_rms_mm"], nullptr);
  EXPECT_EQ(contenders[3]["errors"], nlohmann::json::array());
}

TEST(JsonReport, TellsTheFourDeviationsApart) {
  const nlohmann::json deviation = parsed(sample_report())["deviation"];
  EXPECT_EQ(deviation["uncompensated"]["extruding"]["contour_max_mm"], 0.8);
  EXPECT_EQ(deviation["uncompensated"]["all"]["contour_p99_mm"], 0.8);
  EXPECT_EQ(deviation["compensated"]["extruding"]["contour_rms_mm"], 0.25 * 0.0125);
  EXPECT_EQ(deviation["compensated"]["all"]["tracking_max_mm"], 0.05);
  EXPECT_EQ(deviation["compensated"]["all"]["tracking_rms_mm"], 0.75 * 0.025);
  EXPECT_EQ(deviation["compensated"]["all"]["duration_s"], 2.5);
  EXPECT_EQ(deviation["compensated"]["all"]["contour_max_line"], 17);
}

TEST(JsonReport, SaysHowFarTheNozzlePassesFromCorners) {
  const nlohmann::json corners = parsed(sample_report())["corners"];
  EXPECT_EQ(
      corners["uncompensated"],
      (nlohmann::json{
          {"count", 321}, {"rms_mm", 0.06}, {"p99_mm", 0.11}, {"max_mm", 0.12}, {"max_line", 41}}));
  EXPECT_EQ(corners["compensated"]["max_mm"], 0.015);
  EXPECT_EQ(corners["compensated"]["max_line"], 43);
}

TEST(JsonReport, SaysWhatTheHotendIsAskedFor) {
  const nlohmann::json flow = parsed(sample_report())["flow"];
  EXPECT_EQ(flow["uncompensated"], (nlohmann::json{{"max_mm3_s", 10.5},
                                                   {"max_line", 710},
                                                   {"max_change_mm3_s2", 400.0},
                                                   {"max_change_line", 711}}));
  EXPECT_EQ(flow["compensated"], (nlohmann::json{{"max_mm3_s", 12.4},
                                                 {"max_line", 811},
                                                 {"max_change_mm3_s2", 500.0},
                                                 {"max_change_line", 812}}));
  EXPECT_EQ(flow["largest_difference"], -0.125);
  EXPECT_EQ(flow["largest_difference_line"], 813);
  EXPECT_EQ(flow["difference_p99"], 0.0625);
}

TEST(JsonReport, HasNoDifferenceOfFlowsThatWereNotCompared) {
  Report report = sample_report();
  report.measured.flow_difference = std::nullopt;
  const nlohmann::json flow = parsed(report)["flow"];
  EXPECT_TRUE(flow.at("largest_difference").is_null());
  EXPECT_TRUE(flow.at("largest_difference_line").is_null());
  EXPECT_TRUE(flow.at("difference_p99").is_null());
}

TEST(JsonReport, SaysHowRobustTheOutputIs) {
  const nlohmann::json json = parsed(sample_report());
  EXPECT_EQ(json["freq_error"], 0.1);
  ASSERT_EQ(json["sensitivity"].size(), 2U);
  EXPECT_EQ(json["sensitivity"][0]["frequency_error"], -0.1);
  EXPECT_EQ(json["sensitivity"][0]["compensated"]["contour_rms_mm"], 0.012);
}

TEST(JsonReport, GivesSettingsTheirTypes) {
  const nlohmann::json printer = parsed(sample_report())["printer"];
  EXPECT_EQ(printer["printer.firmware"]["value"], "klipper");
  EXPECT_EQ(printer["printer.travel_x_mm"]["value"], nlohmann::json::array({0, 250}));
  EXPECT_EQ(printer["printer.travel_x_mm"]["origin"], "printer.toml:3");
  EXPECT_TRUE(printer["printer.travel_y_mm"]["value"].is_null());
  EXPECT_EQ(printer["limits.max_accel_mm_s2"]["value"], 5000);
  EXPECT_EQ(printer["limits.max_accel_mm_s2"]["origin"], "--set");
  EXPECT_EQ(printer["solve.jerk_weight"]["value"], 1e-7);
}

TEST(JsonReport, ListsFallbacksWithTheirLines) {
  const nlohmann::json fallbacks = parsed(sample_report())["fallbacks"];
  ASSERT_EQ(fallbacks.size(), 2U);
  EXPECT_EQ(fallbacks[1],
            (nlohmann::json{
                {"first_line", 30}, {"last_line", 44}, {"reason", "worse than the original"}}));
}

TEST(JsonReport, ListsWhereTheBudgetOfLinesIsExceeded) {
  const nlohmann::json budget = parsed(sample_report())["line_budget"];
  EXPECT_EQ(budget["max_lines_per_s"], 850.0);
  EXPECT_EQ(budget["places_above"], 2);
  ASSERT_EQ(budget["above"].size(), 2U);
  EXPECT_EQ(budget["above"][1],
            (nlohmann::json{{"first_line", 90}, {"last_line", 91}, {"lines_per_s", 890.0}}));
  EXPECT_EQ(budget["cost_rms_mm"], 0.0005);
  EXPECT_EQ(budget["cost_max_mm"], 0.0075);
}

TEST(JsonReport, SaysWhatShareOfTheExtrudedPathIsCompensated) {
  EXPECT_EQ(
      parsed(sample_report())["extruded_path"],
      (nlohmann::json{{"total_mm", 8000.0},
                      {"compensated_mm", 7000.0},
                      {"compensated_share", 0.875},
                      {"kept_mm", {{"run left as sliced", 900.0}, {"start unknown", 100.0}}}}));
}

TEST(JsonReport, ListsUnknownCommandsAndWhatTheyCost) {
  const nlohmann::json unknown = parsed(sample_report())["unknown_commands"];
  ASSERT_EQ(unknown.size(), 2U);
  EXPECT_EQ(unknown[0], (nlohmann::json{{"command", "M1234"},
                                        {"count", 40},
                                        {"first_line", 12},
                                        {"moves_kept", 7},
                                        {"kept_mm", 100.0}}));
}

TEST(JsonReport, SaysNothingOfTheWorkBehindAFileThatWasOnlyVerified) {
  Report verified = sample_report();
  verified.solver.engine.clear();
  const nlohmann::json json = parsed(verified);
  for (const char* const key : {"windows", "fallbacks", "kept_moves", "extruded_path",
                                "unknown_commands", "line_budget", "solver"}) {
    EXPECT_TRUE(json[key].is_null()) << key;
  }
  EXPECT_TRUE(json["runs"]["total"].is_null());
  EXPECT_EQ(json["runs"]["compensated"], verified.runs.compensated);
}

TEST(JsonReport, HasEmptyListsRatherThanNone) {
  Report empty;
  empty.solver.engine = "ipopt";
  const nlohmann::json json = parsed(empty);
  EXPECT_EQ(json["fallbacks"], nlohmann::json::array());
  EXPECT_EQ(json["violations"], nlohmann::json::array());
  EXPECT_EQ(json["warnings"], nlohmann::json::array());
  EXPECT_EQ(json["kept_moves"], nlohmann::json::object());
  EXPECT_EQ(json["printer"], nlohmann::json::object());
}

TEST(JsonReport, HasTheHeightOfMachinesThatMoveTheNozzleInZ) {
  Report report = sample_report();
  EXPECT_TRUE(parsed(report)["height"].is_null());
  report.measured.uncompensated.height = verify::HeightStats{0.02, 0.005};
  report.measured.compensated.height = verify::HeightStats{0.003, 0.0006};
  EXPECT_EQ(parsed(report)["height"]["compensated"]["rms_mm"], 0.0006);
  EXPECT_THAT(to_text(report), ::testing::HasSubstr("  height          20.0 → 3.00"));
}

TEST(JsonReport, HasErrorsByPlaceOfMachinesThatChange) {
  Report report = sample_report();
  EXPECT_TRUE(parsed(report)["places"].is_null());
  const verify::PlaceErrors before{
      {{10.0, 10.0, {0.01, 2.0}}, {30.0, 10.0, {0.02, 2.0}}, {50.0, 10.0, {0.03, 2.0}}},
      {{0.0, {0.02, 4.0}}, {1.0, {0.04, 2.0}}}};
  const verify::PlaceErrors after{
      {{10.0, 10.0, {1e-4, 2.0}}, {30.0, 10.0, {2e-4, 2.0}}, {50.0, 10.0, {9e-4, 0.1}}},
      {{0.0, {3e-4, 4.0}}, {1.0, {4e-4, 2.0}}}};
  report.measured.uncompensated.places = before;
  report.measured.compensated.places = after;
  const nlohmann::json places = parsed(report)["places"];
  EXPECT_EQ(places["compensated"]["squares"][1]["contour_rms_mm"], 2e-4);
  EXPECT_EQ(places["uncompensated"]["bands"][1]["from_mm"], 1.0);
  // A square that is hardly printed on does not stand for others.
  const std::string text = to_text(report);
  EXPECT_THAT(text, ::testing::ContainsRegex("middle of the bed, around X30 Y10 +20.0 → 0.20"));
  EXPECT_THAT(text, ::testing::ContainsRegex("where it is worst, around X30 Y10 +20.0 → 0.20"));
  EXPECT_THAT(text, ::testing::ContainsRegex("the last one +40.0 → 0.40"));
}

TEST(JsonReport, SurvivesNamesThatAreNotUtf8) {
  Report report = sample_report();
  report.input = "caf\xe9.gcode";
  report.warnings = {"\xff\xfe"};
  EXPECT_EQ(parsed(report)["input"], "caf\xef\xbf\xbd.gcode");
}

TEST(JsonReport, SurvivesQuotesAndControlCharacters) {
  Report report = sample_report();
  report.input = "a\"b\\c\nd\x01.gcode";
  EXPECT_EQ(parsed(report)["input"], report.input);
}

TEST(JsonReport, WritesNullForWhatIsNotANumber) {
  Report report = sample_report();
  report.performance.print_s_per_wall_s = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(parsed(report)["performance"]["print_s_per_wall_s"].is_null());
}

TEST(JsonReport, IsIndentedAndEndsWithANewline) {
  const std::string text = to_json(sample_report());
  EXPECT_THAT(text, ::testing::StartsWith("{\n  \"schema_version\": 1,\n  \"command\""));
  EXPECT_THAT(text, ::testing::EndsWith("\n}\n"));
}

TEST(ReportPage, DocumentsExactlyTheKeysOfAReport) {
  Report report = sample_report();
  report.measured.uncompensated.height = verify::HeightStats{0.02, 0.005};
  report.measured.compensated.height = verify::HeightStats{0.003, 0.0006};
  const verify::PlaceErrors places{{{10.0, 30.0, {0.01, 2.0}}}, {{3.0, {0.02, 2.0}}}};
  report.measured.uncompensated.places = report.measured.compensated.places = places;
  std::set<std::string> keys;
  collect_keys(parsed(report), "", keys);
  EXPECT_EQ(documented_keys(std::string(test_paths::kDocs) + "/report.md", "compensate and verify"),
            keys);
}

}  // namespace
}  // namespace unflex::report
