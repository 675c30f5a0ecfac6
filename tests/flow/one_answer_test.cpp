// Summary, page and JSON of a print give one answer to one question.

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include "jobs.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/report/format.hpp"

namespace unflex::flow {
namespace {

using nlohmann::json;

// A line that primes the nozzle, then two layers: an octagon, travel, and a zigzag.
std::string print() {
  std::string text =
      "G28\nG90\nM83\nG1 Z0.3 F600\nG1 X40 Y20 F9000\nG1 X80 E4 F1500\n"
      ";LAYER_CHANGE\n;Z:0.3\n;TYPE:External perimeter\n";
  for (int layer = 1; layer <= 2; ++layer) {
    text += fmt::format("G1 X70 Y50 Z{} F9000\nG1 F4800\n", 0.3 * layer);
    for (int corner = 1; corner <= 8; ++corner) {
      const double angle = 0.25 * std::numbers::pi * corner;
      text += fmt::format("G1 X{:.3f} Y{:.3f} E0.3\n", 60.0 + 10.0 * std::cos(angle),
                          50.0 + 10.0 * std::sin(angle));
    }
    text += ";TYPE:Solid infill\nG1 X85 Y45 F9000\nG1 F6000\n";
    for (int side = 0; side < 8; ++side) {
      text += fmt::format("G1 X{} Y{} E0.4\n", side % 2 == 0 ? 97 : 85, 45 + side);
    }
    text += ";LAYER_CHANGE\n;Z:0.6\n;TYPE:External perimeter\n";
  }
  return text;
}

struct Case {
  std::string_view name;
  std::vector<std::string> overrides;
};

void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

// Everything that must not contradict itself in one object of the JSON, and in those below it.
void check_spreads(const json& node, const std::string& path) {
  if (node.is_array()) {
    for (const json& one : node) {
      check_spreads(one, path + "[]");
    }
  }
  if (!node.is_object()) {
    return;
  }
  for (const auto& [key, value] : node.items()) {
    check_spreads(value, path + '.' + key);
    constexpr std::string_view kRms = "rms_mm";
    if (!key.ends_with(kRms) || !value.is_number()) {
      continue;
    }
    const std::string of = key.substr(0, key.size() - kRms.size());
    const auto compare = [&](const std::string& less, const std::string& more) {
      if (node.contains(less) && node.contains(more) && node[more].is_number()) {
        EXPECT_LE(node[less].get<double>(), node[more].get<double>() * (1.0 + 1e-9))
            << path << ": " << less << " and " << more;
      }
    };
    compare(key, of + "max_mm");
    compare(of + "p99_mm", of + "max_mm");
  }
}

class OneAnswer : public ::testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    const testing::JobFolder folder(print(), GetParam().overrides);
    SilentProgress progress;
    const Result<report::Report> report = compensate(folder.job(), progress);
    ASSERT_TRUE(report.has_value()) << to_string(report.error());
    ASSERT_GT(report->runs.compensated, 0U) << testing::complaints(*report);
    text_ = report::to_text(*report);
    page_ = report::to_html(*report);
    json_ = json::parse(report::to_json(*report));
  }

  void check_how_far() const;
  void check_where_worst() const;
  void check_how_long() const;
  void check_how_safe() const;
  void check_filament() const;

  // The numbers that the pattern's groups match in the summary.
  [[nodiscard]] std::vector<std::string> in_summary(const std::string& pattern) const {
    return groups(text_, pattern);
  }
  [[nodiscard]] std::vector<std::string> on_page(const std::string& pattern) const {
    return groups(page_, pattern);
  }

  // The largest and the typical distance from the path where filament is laid.
  [[nodiscard]] std::string laid(std::string_view which, std::string_view what) const {
    return report::micrometres_text(
        json_["deviation"][std::string(which)]["extruding"][std::string(what)].get<double>());
  }

  std::string text_;
  std::string page_;
  json json_;

 private:
  [[nodiscard]] static std::vector<std::string> groups(const std::string& text,
                                                       const std::string& pattern) {
    std::smatch match;
    if (!std::regex_search(text, match, std::regex(pattern))) {
      ADD_FAILURE() << pattern << " is not in\n" << text.substr(0, 4000);
      return {};
    }
    return {std::next(match.begin()), match.end()};
  }
};

using Numbers = std::vector<std::string>;

void OneAnswer::check_how_far() const {
  const Numbers rms = {laid("uncompensated", "contour_rms_mm"),
                       laid("compensated", "contour_rms_mm")};
  EXPECT_EQ(in_summary("Better\\? +(\\S+) → (\\S+) µm RMS"), rms);
  EXPECT_EQ(on_page("\"before\">(\\S+)</b> → <b class=\"after\">(\\S+) µm</b> off the path"), rms);
  const json& exact = json_["answers"]["better"]["exact"];
  EXPECT_EQ((Numbers{report::micrometres_text(exact["now_rms_mm"]),
                     report::micrometres_text(exact["compensated_rms_mm"])}),
            rms);
  EXPECT_EQ(in_summary("\n  extruding .* (\\S+) → (\\S+)\n"), rms);
  EXPECT_EQ(in_summary("sensitivity +(?:\\S+, ){3}(\\S+),"), Numbers{rms[1]});
}

void OneAnswer::check_where_worst() const {
  const Numbers largest = {laid("uncompensated", "contour_max_mm"),
                           laid("compensated", "contour_max_mm")};
  EXPECT_EQ(in_summary("\n  extruding +(\\S+) → (\\S+) "), largest);
  const json& answers = json_["answers"];
  const auto most = [&](const std::string& version, const std::string& start) {
    return report::micrometres_text(std::max(
        answers["worst"][version]["contour_max_mm"].get<double>(), answers[start].get<double>()));
  };
  EXPECT_EQ(
      (Numbers{most("now", "start_now_max_mm"), most("compensated", "start_compensated_max_mm")}),
      largest);
  const Numbers worst = {
      report::micrometres_text(answers["worst"]["compensated"]["contour_max_mm"]),
      report::micrometres_text(answers["worst"]["now"]["contour_max_mm"])};
  EXPECT_EQ(in_summary("Where worst\\? +(\\S+) µm in .*\n +Now (\\S+) µm in"), worst);
  EXPECT_EQ(on_page("Where is it worst\\?</span></h2>\n"
                    "<p class=\"short\"><b class=\"after\">(\\S+) µm</b></p>\n<p>.*</p>\n"
                    "<p>Now <b class=\"before\">(\\S+) µm</b>"),
            worst);
}

void OneAnswer::check_how_long() const {
  const json& time = json_["print_time_s"];
  const Numbers times = {report::duration_text(time["reference"]),
                         report::duration_text(time["emitted"])};
  EXPECT_EQ(in_summary("print time +(.*) planned, (.*) emitted"), times);
  EXPECT_EQ(on_page("Print time</span></dt><dd><span class=\"before\">([^<]*)</span> → "
                    "<span class=\"after\">([^<]*)</span>"),
            times);
}

void OneAnswer::check_how_safe() const {
  const json& reasons = json_["answers"]["safe"]["reasons"];
  ASSERT_FALSE(reasons.empty());
  for (const json& reason : reasons) {
    EXPECT_NE(text_.find(reason.get<std::string>()), std::string::npos) << reason;
  }
  const json& base = json_["base"];
  EXPECT_EQ(in_summary("Motors are asked for at most (\\S+) mm/s and (\\S+) mm/s²"),
            (Numbers{fmt::format("{:.0f}", base["max_velocity_mm_s"].get<double>()),
                     fmt::format("{:.0f}", base["max_accel_mm_s2"].get<double>())}));
  EXPECT_EQ(on_page("Motors are asked for at most (\\S+) mm/s and (\\S+) mm/s²"),
            in_summary("Motors are asked for at most (\\S+) mm/s and (\\S+) mm/s²"));
  EXPECT_EQ(in_summary("speed changes by at most (\\S+) mm/s"),
            Numbers{fmt::format("{:.1f}", base["max_step_mm_s"].get<double>())});
  // What was asked was allowed.
  EXPECT_LE(base["max_accel_mm_s2"].get<double>(), 1.001 * base["accel_limit_mm_s2"].get<double>());
  EXPECT_EQ(in_summary("\n +(\\S+) % of the extruded path is compensated"),
            in_summary("\npath +(\\S+) % of"));
}

void OneAnswer::check_filament() const {
  const json& extrusion = json_["extrusion"];
  const auto of = [&](const char* key) {
    return report::micrometres_text(extrusion[key].get<double>());
  };
  const Numbers lag = {of("uncompensated_lag_rms_mm"), of("lag_rms_mm"),
                       of("uncompensated_lag_max_mm"), of("lag_max_mm")};
  EXPECT_EQ(
      in_summary("laid (\\S+) → (\\S+) µm RMS ahead of the nozzle or behind, (\\S+) → (\\S+) µm"),
      lag);
}

// One test for all, as each makes the print anew.
TEST_P(OneAnswer, IsInSummaryPageAndJson) {
  check_spreads(json_, "");
  check_how_far();
  check_where_worst();
  check_how_long();
  check_how_safe();
  check_filament();
}

INSTANTIATE_TEST_SUITE_P(
    Machines, OneAnswer,
    ::testing::Values(Case{"klipper", {}}, Case{"exact", {"dynamics.freq_error=0"}},
                      Case{"faster", {"dynamics.freq_error=0", "timing.tolerance_um=20"}},
                      Case{"shaped",
                           {"printer.input_shaper_freq_x_hz=45",
                            "printer.input_shaper_freq_y_hz=45", "printer.input_shaper_type=mzv"}},
                      Case{"marlin", {"printer.firmware=marlin"}},
                      Case{"rrf", {"printer.firmware=rrf"}}),
    [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace unflex::flow
