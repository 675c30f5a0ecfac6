// The study's reports.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "paths.hpp"
#include "report/documented_keys.hpp"
#include "unflex/study/study.hpp"

namespace unflex::study {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const Outcome& outcome() {
  static const Outcome made = [] {
    SilentProgress progress;
    Outcome result =
        study_corner({.ipopt = false, .workers = 2, .cases = {"ref", "2B"}, .traces = true},
                     progress)
            .value();
    result.version = "1.2.3";
    return result;
  }();
  return made;
}

std::size_t count(const std::string& text, std::string_view what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) {
    ++found;
  }
  return found;
}

TEST(StudyText, HasARowForEveryMethodAndAColumnForEveryCase) {
  const std::string text = to_text(outcome());
  for (std::size_t i = 0; i < kMethodCount; ++i) {
    EXPECT_THAT(text, HasSubstr("  " + std::string(name(static_cast<Method>(i))) + "  "));
  }
  EXPECT_THAT(text, HasSubstr("contour error max, µm            ref      2B\n"
                              "  uncompensated                  464     316\n"
                              "  ZV                             112       —\n"));
  EXPECT_THAT(text, HasSubstr("1 ms: 16 ("));
  EXPECT_THAT(text, HasSubstr("unknowns/equations                  ref         2B\n"
                              "  filtered B-spline              88/500     88/500\n"
                              "  thesis, all equations          98/290     98/290\n"));
  EXPECT_THAT(text, HasSubstr("base made in, ms                 ref      2B\n"
                              "  filtered B-spline         "));
}

TEST(StudyJson, SaysHowLargeTheProblemIsWhereThereIsOne) {
  const auto json = nlohmann::json::parse(to_json(outcome()));
  const auto& methods = json["cases"][0]["methods"];
  const auto& base_ms = json["performance"]["cases"][0]["base_ms"];
  ASSERT_EQ(methods.size(), kMethodCount);
  ASSERT_EQ(base_ms.size(), kMethodCount);
  for (std::size_t i = 0; i < kMethodCount; ++i) {
    const bool solves = static_cast<Method>(i) >= Method::filtered_spline;
    EXPECT_EQ(methods[i]["unknowns"].is_number(), solves) << methods[i]["method"];
    EXPECT_EQ(methods[i]["equations"].is_number(), solves) << methods[i]["method"];
    EXPECT_EQ(methods[i]["iterations"] > 0, solves) << methods[i]["method"];
    EXPECT_GT(base_ms[i], 0.0) << methods[i]["method"];
  }
  EXPECT_EQ(json["performance"]["cases"][1]["case"], "2B");
  EXPECT_EQ(json["performance"]["cases"][1]["base_ms"][1], nullptr) << "ZV is not used";
}

TEST(StudyHtml, SaysHowLargeTheProblemIs) {
  const std::string html = to_html(outcome());
  EXPECT_THAT(html, HasSubstr("<th scope=\"row\">thesis, all equations</th><td>98/290<br>"));
}

TEST(StudyJson, IsDocumentedKeyByKey) {
  Outcome full = outcome();
  full.printer.push_back({"limits.max_accel_mm_s2", "5000", "default"});
  std::set<std::string> keys;
  report::collect_keys(nlohmann::json::parse(to_json(full)), "", keys);
  EXPECT_EQ(report::documented_keys(std::string(test_paths::kDocs) + "/report.md", "study"), keys);
}

// Uncompensated the nozzle overshoots straight through the corner; a long shaper cuts it.
TEST(StudyJson, SaysHowFarTheNozzlePassesFromCorners) {
  const auto json = nlohmann::json::parse(to_json(outcome()));
  for (const auto& method : json["cases"][0]["methods"]) {
    if (method["used"] == true) {
      const auto& exact = method["deviation"][0];
      EXPECT_EQ(exact["corners"], 1) << method["method"];
      EXPECT_EQ(exact["corner_max_mm"], exact["corner_rms_mm"]) << method["method"];
    }
  }
  const auto distance_mm = [&](Method method) {
    return json["cases"][0]["methods"][static_cast<std::size_t>(method)]["deviation"][0]
               ["corner_max_mm"]
                   .get<double>();
  };
  EXPECT_LT(distance_mm(Method::uncompensated), 1e-4);
  EXPECT_NEAR(distance_mm(Method::zvd), 0.210, 0.005);
  EXPECT_LT(distance_mm(Method::unflex_4x), 1e-4);
}

TEST(StudyJson, SaysWhyAMethodIsNotUsed) {
  const auto json = nlohmann::json::parse(to_json(outcome()));
  const auto& zv = json["cases"][1]["methods"][1];
  EXPECT_EQ(zv["method"], "ZV");
  EXPECT_EQ(zv["used"], false);
  EXPECT_THAT(zv["remark"].get<std::string>(), HasSubstr("undefined at ζ = 1"));
  EXPECT_FALSE(zv.contains("deviation"));
  EXPECT_EQ(json["input"], nullptr);
}

TEST(StudyHtml, HasFiveFiguresForEveryMethodThatIsUsed) {
  const std::string html = to_html(outcome());
  // 2B has no shapers; one more plot shows the sensitivity, and three a step and a staircase.
  EXPECT_EQ(count(html, "<div data-figures="), 19U + 10U);
  EXPECT_EQ(count(html, "<svg class=\"plot\""), 5U * (19U + 10U) + 4U);
  EXPECT_EQ(count(html, "<div data-figures=\"ref 16\">"), 1U);  // shown at first
  EXPECT_THAT(html, Not(HasSubstr("nan")));
  EXPECT_THAT(html, Not(HasSubstr("http://")));
  EXPECT_THAT(html, Not(HasSubstr("https://")));
}

TEST(StudyHtml, EscapesWhatComesFromOutside) {
  Outcome print = outcome();
  print.input = "<script>alert(1)</script>.gcode";
  print.printer.push_back({"printer.name", "\"</dd><script>\"", "a&b.toml:3"});
  print.warnings = {"line <i>7</i>"};
  const std::string html = to_html(print);
  EXPECT_THAT(html, Not(HasSubstr("<script>alert")));
  EXPECT_THAT(html, HasSubstr("&lt;script&gt;alert(1)"));
  EXPECT_THAT(html, Not(HasSubstr("</dd><script>")));
  EXPECT_THAT(html, HasSubstr("a&amp;b.toml:3"));
  EXPECT_THAT(html, HasSubstr("<li>line &lt;i&gt;7&lt;/i&gt;</li>"));
}

// The error is zero if there is only travel, or if the nozzle follows the plan exactly.
TEST(StudyHtml, OfNoErrorAtAllIsStillAPage) {
  Outcome still = outcome();
  for (MethodResult& method : still.cases.front().methods) {
    method.straying = {};
  }
  EXPECT_THAT(to_html(still), Not(HasSubstr("nan")));
  EXPECT_THAT(to_html(still), Not(HasSubstr("inf")));
}

TEST(StudyHtml, OfAllCasesIsSmall) {
  SilentProgress progress;
  const Result<Outcome> all =
      study_corner({.ipopt = false, .workers = 2, .cases = {}, .traces = true}, progress);
  ASSERT_TRUE(all.has_value());
  EXPECT_LT(to_html(*all).size(), 3'000'000U);
}

// The errors of the thesis that the design lists, with their places.
TEST(Theory, NamesEveryErrorOfTheThesis) {
  std::ifstream page(std::string(test_paths::kDocs) + "/theory.md");
  const std::string text{std::istreambuf_iterator<char>(page), {}};
  const std::string table = text.substr(text.find("## Where the thesis' text differs"));
  for (const char* place :
       {"| eq. 2.2 |", "| eq. 2.4, slope in the middle |", "| eq. 3.3 |", "| eq. 3.6 |",
        "| eq. 3.9 |", "| eq. 3.11 |", "| eq. 3.14 |", "| eq. 3.18 |",
        "| appendix, damped frequency |", "| appendix, Runge–Kutta |",
        "| appendix, junction speed |", "| appendix, lookahead |", "| formulation |",
        "| jagged base |", "| end of the job |"}) {
    EXPECT_THAT(table, HasSubstr(place));
  }
}

}  // namespace
}  // namespace unflex::study
