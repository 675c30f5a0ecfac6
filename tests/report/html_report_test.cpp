#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "report/sample_report.hpp"
#include "unflex/core/base64.hpp"
#include "unflex/report/report.hpp"

namespace unflex::report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr const char* kHostile =
    "</script><script>alert('x')</script><img src=x onerror=\"alert(1)\">";

Recording page_recording() {
  Recording recording;
  recording.layers = {{0.2, 10, {{0.08, 0.02}, {0.004, 0.001}}, 4}};
  recording.paths.bytes = std::string("\x00\xff\x10<", 4);
  recording.features = {{"", 1.0, {}}, {"External perimeter", 9.0, {{0.08, 0.02}, {0.004, 0.001}}}};
  Place place;
  place.line = 42;
  place.feature = 1;
  place.before_mm = 0.08;
  place.after_mm = 0.004;
  place.before = {{-0.5, 0.25, {1.0, 2.0}, {3.0, 4.0}, {5.0, 6.0}}};
  recording.worst_before = {place};
  recording.histogram = {{0.0, 1.0, 2.0}, {1e-3, 3.0, 4.0}};
  recording.frequency_errors = {-0.1, 0.0, 0.1};
  recording.contenders = {{"as sliced", {{0.1, 0.03}, {0.08, 0.02}, {0.07, 0.01}}, true},
                          {"EI", {}}};
  return recording;
}

Report recorded_report() {
  Report report = sample_report();
  report.recording = page_recording();
  return report;
}

// What is between the element's tags.
std::string element(const std::string& page, const std::string& id) {
  const std::size_t at = page.find("id=\"" + id + "\">");
  EXPECT_NE(at, std::string::npos) << id;
  const std::size_t begin = page.find('>', at) + 1;
  return page.substr(begin, page.find("</script>", begin) - begin);
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++found;
  }
  return found;
}

TEST(HtmlReport, AnswersThreeQuestionsFirst) {
  const std::string page = to_html(sample_report());
  EXPECT_THAT(page, HasSubstr("<title>cube.gcode</title>"));
  EXPECT_THAT(page, HasSubstr("<b class=\"before\">16.0</b> → <b class=\"after\">2.00 µm</b> at "
                              "the edges of the line"));
  EXPECT_THAT(page, HasSubstr("8.0 times less than now, under the printer&#39;s own input shaper, "
                              "MZV 45 Hz."));
  EXPECT_THAT(page, HasSubstr("The line&#39;s width is 6.00 → 0.50 % RMS off, 31.0 → 2.10 for 99 % "
                              "of the way."));
  EXPECT_THAT(
      page, HasSubstr("The nozzle is <b class=\"before\">200</b> → <b class=\"after\">3.12 µm</b> "
                      "off the path: 64 times less than now."));
  EXPECT_THAT(page, HasSubstr("<b class=\"before\">150</b> → <b class=\"after\">6.10 µm</b> if the "
                              "frequencies are 5 % off."));
  EXPECT_THAT(page, HasSubstr("<b class=\"after\">12.0 µm</b></p>"));
  EXPECT_THAT(page, HasSubstr(">line 41, layer 1, at X20.0 Y-2.3</a>"));
  EXPECT_THAT(page, HasSubstr("<b class=\"before\">800 µm</b> in line 95, layer 2, Perimeter"));
  EXPECT_THAT(page, HasSubstr("Before the first layer <b class=\"before\">900</b>"));
  EXPECT_THAT(page, HasSubstr("2.5 times the printer&#39;s own limit of 8000 mm/s² (--set)"));
  EXPECT_THAT(page, HasSubstr("Made for X 45 Hz, ζ 0.06 (printer.toml:7); Y 38.5 Hz, ζ 0.1 "
                              "(--set); frequencies up to 10 % off."));
  EXPECT_THAT(page, HasSubstr("1 warning</a>, the first: cube.gcode:1: warning: no G28"));
  EXPECT_THAT(page, HasSubstr("+0.50 %"));
}

TEST(HtmlReport, SaysHowFarTheNozzlePassesFromCorners) {
  Report report = recorded_report();
  const std::string page = to_html(report);
  EXPECT_THAT(page, HasSubstr("Typical corner"));
  EXPECT_THAT(page, HasSubstr("60.0 → 0.50 µm RMS, 99 % within 110 → 2.50 µm, 120 → 15.0 µm at "
                              "most, as sliced in line 41, compensated in line 43"));
  report.measured.uncompensated.corners = report.measured.compensated.corners = {};
  EXPECT_THAT(to_html(report), Not(HasSubstr("Typical corner")));
}

TEST(HtmlReport, SaysWhatTheHotendIsAskedFor) {
  Report report = recorded_report();
  const std::string asked =
      "10.5 → 12.4 mm³/s at most, as sliced in line 710, compensated in line 811 of the output; it "
      "changes by 400 → 500 mm³/s² at most, in lines 711 and 812";
  EXPECT_THAT(to_html(report), HasSubstr(asked + "; the hotend melts 15.0 mm³/s\""));
  report.max_flow_mm3_s = std::nullopt;
  EXPECT_THAT(to_html(report), HasSubstr(asked + "\""));
}

TEST(HtmlReport, SaysWhetherTheFilamentComesFasterThanAsSliced) {
  Report report = recorded_report();
  EXPECT_THAT(to_html(report), HasSubstr("at most 12.5 % less than as sliced over 10 ms"));
  report.measured.flow_difference = std::nullopt;
  EXPECT_THAT(to_html(report), Not(HasSubstr("Rate of filament")));
}

TEST(HtmlReport, SaysWhatBecameOfFilamentAndHowFastMotorsStep) {
  Report report = recorded_report();
  EXPECT_THAT(to_html(report),
              HasSubstr("100.00 mm of moves that print became 110.50 mm, E × 1.10000 to 1.12000, "
                        "240.5 mm³ of material; the print ends at 108.5 mm of the filament"));
  EXPECT_THAT(to_html(report), HasSubstr(" kHz at most"));
  report.fitted_filament = std::nullopt;
  report.step_rates = {};
  EXPECT_THAT(to_html(report), Not(HasSubstr("of moves that print became")));
  EXPECT_THAT(to_html(report), Not(HasSubstr("kHz at most")));
}

TEST(HtmlReport, DrawsTheTemperature) {
  Report report = recorded_report();
  EXPECT_THAT(to_html(report), HasSubstr("<h2 id=\"temperature-h\">Temperature</h2>"));
  EXPECT_THAT(to_html(report), HasSubstr("1.3 s too cold and 8.2 s too hot"));
  EXPECT_THAT(to_html(report), HasSubstr("temperature, °C"));
  report.temperature->is_known = false;
  EXPECT_THAT(to_html(report), Not(HasSubstr("temperature, °C")));
  report.temperature = std::nullopt;
  EXPECT_THAT(to_html(report), Not(HasSubstr("temperature-h")));
}

TEST(HtmlReport, SaysWhenRulesAreBroken) {
  Report report = recorded_report();
  EXPECT_THAT(to_html(report), HasSubstr("do not print it</a>"));
  report.violation_count = 0;
  EXPECT_THAT(to_html(report), Not(HasSubstr("do not print it")));
}

TEST(HtmlReport, DoesNotSpeakOfGainWhereThereIsNone) {
  Report report = recorded_report();
  report.measured.compensated = report.measured.uncompensated;
  report.measured.compensated.corners = report.measured.uncompensated.corners;
  report.measured.compensated.time_s = report.measured.uncompensated.time_s;
  const std::string page = to_html(report);
  EXPECT_THAT(page, Not(HasSubstr("× less")));
  EXPECT_THAT(page, HasSubstr("as much as now"));
}

TEST(HtmlReport, HoldsTheDataThatItsScriptReads) {
  const std::string page = to_html(recorded_report());
  EXPECT_EQ(element(page, "paths"), to_base64(page_recording().paths.bytes));
  const nlohmann::json data = nlohmann::json::parse(element(page, "data"));
  EXPECT_EQ(data["layers"], nlohmann::json::parse("[[0.2, 10, 4, 80.0, 20.0, 4.0, 1.0]]"));
  EXPECT_EQ(data["features"][1]["name"], "External perimeter");
  EXPECT_EQ(data["worst"][0][0]["line"], 42);
  EXPECT_EQ(data["worst"][0][0]["um"], nlohmann::json::parse("[80.0, 4.0]"));
  // −0.5, 0.25, 1 … 6 as floats.
  EXPECT_EQ(data["worst"][0][0]["moments"][0], "AAAAvwAAgD4AAIA/AAAAQAAAQEAAAIBAAACgQAAAwEA=");
  EXPECT_EQ(data["worst"][0][0]["moments"][1], "");
  EXPECT_EQ(data["worst"][1], nlohmann::json::array());
  EXPECT_EQ(data["histogram"], nlohmann::json::parse("[[0.0, 1.0, 2.0], [1.0, 3.0, 4.0]]"));
  EXPECT_EQ(data["contenders"][0]["spreads"][2], nlohmann::json::parse("[70.0, 10.0]"));
  EXPECT_EQ(data["contenders"][0]["drawn"], true);
  EXPECT_EQ(data["contenders"][0]["corners"], nullptr);
  EXPECT_EQ(data["contenders"][1]["spreads"], nlohmann::json::array());
  EXPECT_EQ(data["contenders"][1]["drawn"], false);
  EXPECT_EQ(data["freq_error"], 0.1);
  EXPECT_EQ(data["settings"].size(), sample_report().printer.size());
  EXPECT_EQ(data["remarks"]["violations"][0], "out.gcode:7: outside the travel");
}

TEST(HtmlReport, ShowsFirstHowRobustThePrintIs) {
  const std::string page = to_html(recorded_report());
  const std::size_t at = page.find("id=\"sensitivity\"");
  EXPECT_LT(page.find("class=\"card hero\""), at);
  EXPECT_LT(at, page.find("id=\"print\""));
}

TEST(HtmlReport, TellsWhatSeveralModelsCost) {
  Report report = recorded_report();
  report.others.robustness = {0.003, 0.0005};
  const auto facts = [&] {
    return nlohmann::json::parse(element(to_html(report), "data"))["facts"];
  };
  EXPECT_NE(facts().dump().find("3.00 µm RMS as optimised, 0.50 for the nominal alone"),
            std::string::npos);
  report.others.robustness.reset();
  EXPECT_EQ(facts().dump().find("several models"), std::string::npos);
  EXPECT_NE(facts().dump().find("4.00 to 9.00 µm RMS"), std::string::npos);
}

TEST(HtmlReport, LetsNoTextFromOutsideBecomeMarkup) {
  Report report = recorded_report();
  report.input = report.output = kHostile;
  report.warnings = {kHostile};
  report.violations = {kHostile};
  report.runs.fallbacks = {{1, 2, kHostile}};
  report.runs.kept_moves = {{kHostile, 1}};
  report.printer = {{kHostile, kHostile, kHostile}};
  report.recording->features[1].name = kHostile;
  const std::string page = to_html(report);
  EXPECT_EQ(count(page, "<script>alert"), 0U);
  EXPECT_EQ(count(page, "<img"), 0U);
  EXPECT_EQ(count(page, "<script"), count(to_html(recorded_report()), "<script"));
  EXPECT_EQ(count(page, "</script>"), count(page, "<script"));
  const nlohmann::json data = nlohmann::json::parse(element(page, "data"));
  EXPECT_EQ(data["features"][1]["name"], kHostile);
  EXPECT_EQ(data["facts"][0][1], kHostile);
}

TEST(HtmlReport, BoundsItsLists) {
  Report report = recorded_report();
  report.warnings.assign(100'000, std::string(100, 'w'));
  report.violations.assign(1000, "v");
  report.runs.fallbacks.assign(1000, {1, 2, "f"});
  const std::string page = to_html(report);
  EXPECT_LT(page.size(), 200'000U);
  const nlohmann::json remarks = nlohmann::json::parse(element(page, "data"))["remarks"];
  EXPECT_EQ(remarks["warnings"].size(), 100U);
  EXPECT_EQ(remarks["warning_count"], 100'000);
}

TEST(HtmlReport, IsBelowThreeMegabytesForTheLargestRecording) {
  Report report = recorded_report();
  Recording& recording = *report.recording;
  recording.paths.bytes.assign(1'500'000, 'x');
  recording.layers.assign(
      8192, {123.456, 1'234'567, {{0.123456, 0.0123456}, {0.0123456, 0.00123456}}, 1'234'567});
  recording.features.assign(48, {std::string(60, '<'), 12345.6, {{0.1, 0.1}, {0.1, 0.1}}});
  Place place = recording.worst_before[0];
  place.before.assign(151, {0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8});
  place.after = place.before;
  recording.worst_before.assign(12, place);
  recording.worst_after = recording.worst_before;
  EXPECT_LT(to_html(report).size(), 3'000'000U);
}

TEST(HtmlReport, OfAnEmptyPrintHasNoInfinities) {
  Report empty;
  empty.recording.emplace();
  const std::string page = to_html(empty);
  EXPECT_THAT(page, HasSubstr("0.00 µm"));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  EXPECT_THAT(page, Not(HasSubstr("inf ")));
}

TEST(HtmlReport, DrawsTheBedOfMachinesThatChange) {
  Report report = recorded_report();
  EXPECT_THAT(to_html(report), Not(HasSubstr("places-h")));
  const verify::PlaceErrors before{{{10.0, 10.0, {0.02, 2.0}}, {30.0, 50.0, {0.01, 2.0}}},
                                   {{0.0, {0.02, 4.0}}, {1.0, {0.04, 2.0}}}};
  verify::PlaceErrors after = before;
  after.squares[1].error.rms_mm = 4e-4;
  report.measured.uncompensated.places = before;
  report.measured.compensated.places = after;
  const std::string html = to_html(report);
  EXPECT_THAT(html, HasSubstr("<h2 id=\"places-h\">Over the bed and the height</h2>"));
  EXPECT_THAT(html, HasSubstr("<title>X30 Y50: 0.40 µm RMS</title>"));
  // Y points upwards: the square that is further back is higher.
  EXPECT_THAT(html, HasSubstr("<rect x=\"20\" y=\"0\" width=\"19\""));
  EXPECT_THAT(html, HasSubstr("<rect x=\"0\" y=\"40\" width=\"19\""));
  EXPECT_THAT(html, HasSubstr("<td>1 to 2 mm</td><td>40.0</td><td>40.0</td>"));
}

}  // namespace
}  // namespace unflex::report
