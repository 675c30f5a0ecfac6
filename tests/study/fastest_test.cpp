// The search for the fastest motion that keeps a tolerance.
#include "unflex/study/fastest.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <utility>

#include "paths.hpp"
#include "report/documented_keys.hpp"

namespace unflex::study {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Limits under which a print takes a time of round figures.
Candidate candidate(double accel_mm_s2, double corner_mm_s, double time_s) {
  return {{accel_mm_s2, corner_mm_s}, time_s};
}

const std::vector<Candidate> kCandidates = {
    candidate(1000.0, 1.0, 40.0), candidate(1000.0, 5.0, 35.0), candidate(2000.0, 1.0, 30.0),
    candidate(2000.0, 5.0, 25.0), candidate(4000.0, 1.0, 20.0)};

// Errors that grow with acceleration and corners: 10 µm for 1000 mm/s², 2 µm for 1 mm/s.
PathErrors errors_of(const PlanLimits& limits) {
  const double error_mm = 1e-5 * limits.accel_mm_s2 + 2e-3 * limits.corner_mm_s;
  return {error_mm, error_mm};
}

TEST(ToleranceRule, AllowsAThousandthOfTheTimeATenthMore) {
  const ToleranceRule rule;
  EXPECT_TRUE(rule.keeps({0.020, 0.022}, 0.020));
  EXPECT_FALSE(rule.keeps({0.020, 0.0221}, 0.020));
  EXPECT_FALSE(rule.keeps({0.0201, 0.0201}, 0.020));
  const ToleranceRule strict{.largest_times = 1.0};
  EXPECT_TRUE(strict.keeps({0.010, 0.020}, 0.020));
  EXPECT_FALSE(strict.keeps({0.010, 0.0201}, 0.020));
}

TEST(Fastest, IsTheFirstThatKeepsTheToleranceInOrderOfTime) {
  // In any order of the tolerances, and none keeps the narrowest.
  const auto found = fastest(kCandidates, {0.013, 0.023, 0.005}, {},
                             [](const PlanLimits& limits, double) { return errors_of(limits); });
  ASSERT_EQ(found.size(), 3U);
  ASSERT_TRUE(found[0] && found[1]);
  EXPECT_EQ(found[0]->limits, (PlanLimits{1000.0, 1.0}));
  EXPECT_EQ(found[0]->time_s, 40.0);
  EXPECT_EQ(found[1]->limits, (PlanLimits{2000.0, 1.0}));
  EXPECT_EQ(found[1]->time_s, 30.0);
  EXPECT_EQ(found[1]->errors.max_mm, errors_of({2000.0, 1.0}).max_mm);
  EXPECT_FALSE(found[2]);
}

TEST(Fastest, MeasuresNoCandidateTwiceAndNoneThatDoesNotCount) {
  std::vector<std::pair<double, double>> asked;
  const auto found =
      fastest(kCandidates, {0.023, 0.1}, {}, [&](const PlanLimits& limits, double tolerance_mm) {
        asked.emplace_back(limits.accel_mm_s2 + limits.corner_mm_s, tolerance_mm);
        return limits.accel_mm_s2 > 2000.0 || limits.corner_mm_s < 5.0
                   ? std::optional(errors_of(limits))
                   : std::nullopt;
      });
  // The wide tolerance is kept at once. What then breaks the narrow one is left for the next.
  EXPECT_THAT(asked, ::testing::ElementsAre(std::pair(4001.0, 0.1), std::pair(2005.0, 0.023),
                                            std::pair(2001.0, 0.023)));
  EXPECT_EQ(found[1]->time_s, 20.0);
  EXPECT_EQ(found[0]->time_s, 30.0);
}

TEST(Fastest, TakesTheGentlestAmongEquals) {
  const auto found = fastest(
      {candidate(4000.0, 1.0, 10.0), candidate(2000.0, 5.0, 10.0), candidate(2000.0, 1.0, 10.0)},
      {1.0}, {}, [](const PlanLimits& limits, double) { return errors_of(limits); });
  EXPECT_EQ(found[0]->limits, (PlanLimits{2000.0, 1.0}));
}

// A path through these places at 100 mm/s, of which some legs lay filament.
struct Leg {
  double x_mm = 0.0;
  double y_mm = 0.0;
  bool extruding = true;
};

PrintPath path_of(const std::vector<Leg>& legs) {
  PrintPath path;
  Stretch stretch;
  gcode::Position at{};
  for (const Leg& leg : legs) {
    gcode::Segment segment;
    segment.start_mm = at;
    at[gcode::X] = leg.x_mm;
    at[gcode::Y] = leg.y_mm;
    at[gcode::E] += leg.extruding ? 0.5 : 0.0;
    segment.end_mm = at;
    segment.feed_mm_s = 100.0;
    stretch.push_back(segment);
  }
  path.stretches = {stretch, stretch};
  return path;
}

dynamics::FlexibleAxis axis(double freq_hz, double damping_ratio) {
  return {2.0 * std::numbers::pi * freq_hz, damping_ratio};
}

FastestSetup setup(std::vector<double> tolerances_mm, unsigned workers = 1) {
  return {.nozzle = {axis(45.0, 0.06), axis(45.0, 0.06)},
          .tolerances_mm = std::move(tolerances_mm),
          .rule = {},
          .workers = workers};
}

FastestOutcome studied(const PrintPath& path, const FastestSetup& with) {
  SilentProgress progress;
  // Any plan does for the print as sliced.
  planner::PlannedMove still;
  still.segment = path.stretches.front().front();
  still.cruise_s = 2.0;
  return study_fastest(path, {{still}}, with, progress).value();
}

// On a straight line nothing leads off the path, so the fastest motion is that with the most
// acceleration. Corners have no part in it.
TEST(Fastest, OfAStraightLineHasTheMostAcceleration) {
  PrintPath path =
      path_of({{10.0, 0.0, false}, {20.0, 0.0}, {30.0, 0.0, false}, {60.0, 0.0, false}});
  path.dwell_s = 1.0;
  const FastestOutcome outcome = studied(path, setup({0.001}));
  ASSERT_EQ(outcome.contenders.size(), 4U);
  for (const FastestOfContender& contender : outcome.contenders) {
    ASSERT_TRUE(contender.at[0]) << contender.name;
    EXPECT_EQ(contender.at[0]->limits, (PlanLimits{40000.0, 0.5})) << contender.name;
    EXPECT_LT(contender.at[0]->errors.max_mm, 1e-9) << contender.name;
    // Length over speed and little more, twice, and the pause.
    EXPECT_GT(contender.at[0]->time_s, 2.2) << contender.name;
    EXPECT_LT(contender.at[0]->time_s, 2.3) << contender.name;
  }
}

const PrintPath& zigzag() {
  static const PrintPath path = path_of({{10.0, 0.0, false},
                                         {30.0, 0.0},
                                         {30.0, 10.0},
                                         {40.0, 10.0},
                                         {45.0, 20.0},
                                         {20.0, 20.0},
                                         {10.0, 0.0},
                                         {0.0, 0.0, false}});
  return path;
}

TEST(Fastest, OfCornersDependsOnToleranceAndShaper) {
  const FastestOutcome outcome = studied(zigzag(), setup({0.01, 0.02, 0.1}));
  for (const FastestOfContender& contender : outcome.contenders) {
    double time_s = 1e9;
    for (std::size_t i = 0; i < outcome.tolerances_mm.size(); ++i) {
      if (!contender.at[i]) {
        continue;
      }
      EXPECT_LT(contender.at[i]->time_s, time_s) << contender.name;
      time_s = contender.at[i]->time_s;
      EXPECT_TRUE(outcome.rule.keeps(contender.at[i]->errors, outcome.tolerances_mm[i]));
      // The rule is used up by more than half: a slower motion would do otherwise.
      EXPECT_GT(contender.at[i]->errors.max_mm, 0.5 * outcome.tolerances_mm[i]) << contender.name;
    }
  }
  const auto time_s = [&](std::size_t contender) {
    return outcome.contenders[contender].at[1]->time_s;
  };
  EXPECT_EQ(outcome.contenders[1].name, "ZV");
  EXPECT_LT(time_s(1), time_s(2));
  EXPECT_LT(time_s(2), time_s(3));
  EXPECT_LT(time_s(3), time_s(0));
}

TEST(Fastest, IsSlowerWhereEveryMomentCounts) {
  FastestSetup strict = setup({0.01, 0.02, 0.1});
  strict.rule.largest_times = 1.0;
  const FastestOutcome usual = studied(zigzag(), setup({0.01, 0.02, 0.1}));
  const FastestOutcome outcome = studied(zigzag(), strict);
  for (std::size_t c = 0; c < outcome.contenders.size(); ++c) {
    for (std::size_t i = 0; i < outcome.tolerances_mm.size(); ++i) {
      if (outcome.contenders[c].at[i]) {
        EXPECT_LE(outcome.contenders[c].at[i]->errors.max_mm, outcome.tolerances_mm[i]);
        EXPECT_GE(outcome.contenders[c].at[i]->time_s, usual.contenders[c].at[i]->time_s);
      }
    }
  }
}

TEST(Fastest, IsTheSameForAnyNumberOfThreads) {
  EXPECT_EQ(to_json(studied(zigzag(), setup({0.02}, 1))),
            to_json(studied(zigzag(), setup({0.02}, 3))));
}

TEST(Fastest, KnowsWhatKlipperAdvises) {
  const FastestOutcome outcome = studied(zigzag(), setup({0.02}));
  EXPECT_FALSE(outcome.contenders[0].advised);
  EXPECT_NEAR(outcome.contenders[1].advised->limits->accel_mm_s2, 7817.0, 1.0);
  EXPECT_EQ(outcome.contenders[1].advised->limits->corner_mm_s, 5.0);
  EXPECT_NEAR(outcome.contenders[2].advised->limits->accel_mm_s2, 5923.0, 1.0);
  EXPECT_GT(outcome.contenders[2].advised->errors.max_mm, 0.0);
}

TEST(Fastest, LeavesOutShapersWithoutAVibration) {
  FastestSetup damped = setup({0.1});
  damped.nozzle.y = axis(45.0, 1.0);
  const FastestOutcome outcome = studied(zigzag(), damped);
  EXPECT_EQ(outcome.contenders.size(), 1U);
  ASSERT_EQ(outcome.warnings.size(), 3U);
  EXPECT_THAT(outcome.warnings[0], HasSubstr("ZV is left out: undefined at ζ = 1"));
}

TEST(Fastest, EndsWhenItIsCancelled) {
  class Cancelled final : public Progress {
   public:
    void update(std::string_view, double) override {}
    [[nodiscard]] bool cancelled() const override { return true; }
  };
  Cancelled progress;
  const auto outcome = study_fastest(zigzag(), {}, setup({0.02}), progress);
  ASSERT_FALSE(outcome);
  EXPECT_EQ(outcome.error().kind, ErrorKind::internal);
}

TEST(FastestReport, IsDocumentedAndNamesEachContender) {
  FastestOutcome outcome = studied(zigzag(), setup({0.02, 0.0001}));
  outcome.input = "print.gcode";
  outcome.printer.push_back({"limits.max_accel_mm_s2", "5000", "default"});
  std::set<std::string> keys;
  report::collect_keys(nlohmann::json::parse(to_json(outcome)), "", keys);
  EXPECT_EQ(
      report::documented_keys(std::string(test_paths::kDocs) + "/report.md", "study --faster"),
      keys);
  const auto json = nlohmann::json::parse(to_json(outcome));
  EXPECT_EQ(json["tolerances"][1]["contenders"][2]["found"], false);
  EXPECT_FALSE(json["tolerances"][1]["contenders"][2].contains("time_s"));
  const std::string text = to_text(outcome);
  for (const char* name : {"no shaper", "ZV", "MZV", "EI", "as sliced", "  0.1 µm", "  20 µm"}) {
    EXPECT_THAT(text, HasSubstr(name));
  }
  EXPECT_THAT(text, HasSubstr("99.9 % of the extruding time, and at most 1.1 times it"));
  outcome.rule.largest_times = 1.0;
  EXPECT_THAT(to_text(outcome), HasSubstr("within the tolerance at all times"));
}

TEST(Fastest, IsBoundByTheSpeedsOfTheFile) {
  PrintPath path = path_of({{30.0, 0.0}, {30.0, 40.0, false}});
  path.dwell_s = 0.5;
  planner::PlannedMove filament;
  filament.kinematic = false;
  filament.cruise_s = 0.25;
  planner::PlannedMove travel;
  travel.cruise_s = 9.0;
  // The stretch is there twice.
  EXPECT_NEAR(time_at_feed_s(path, {{filament, travel}}), 2.0 * 0.7 + 0.5 + 0.25, 1e-12);
}

// unflex, which does not plan by limits of the grid, and is not always within the tolerance.
FastestOutcome with_unflex() {
  FastestOutcome outcome = studied(zigzag(), setup({0.02, 0.01}));
  outcome.input = "<print>.gcode";
  outcome.contenders.push_back(
      {std::string(kUnflex), {TimedMotion{std::nullopt, 1.25, {0.01, 0.02}}, std::nullopt}, {}});
  return outcome;
}

TEST(FastestReport, HoldsUnflexAgainstTheBestOther) {
  const FastestOutcome outcome = with_unflex();
  const double zv_s = outcome.contenders[1].at[0]->time_s;
  EXPECT_NEAR(outcome.unflex_saves(0).value(), 1.0 - 1.25 / zv_s, 1e-12);
  EXPECT_FALSE(outcome.unflex_saves(1));
  const std::string text = to_text(outcome);
  EXPECT_THAT(text, HasSubstr("print time, s          20 µm     10 µm\n"));
  EXPECT_THAT(text, HasSubstr("  unflex                1.25         —\n  always at F "));
  EXPECT_THAT(text, HasSubstr("unflex             1.25                         10.0       20.0\n"));
  EXPECT_THAT(text, HasSubstr("  unflex saves          50 %         —\n"));
  EXPECT_THAT(text, HasSubstr("all made for the exact frequencies"));
  const auto json = nlohmann::json::parse(to_json(outcome));
  const auto& unflex = json["tolerances"][0]["contenders"][4];
  EXPECT_EQ(unflex["time_s"], 1.25);
  EXPECT_FALSE(unflex.contains("max_accel_mm_s2"));
  EXPECT_EQ(json["tolerances"][0]["unflex_saves"], *outcome.unflex_saves(0));
  EXPECT_TRUE(json["tolerances"][1]["unflex_saves"].is_null());
  EXPECT_EQ(json["always_at_f"]["time_s"], outcome.at_feed_s);
}

TEST(FastestReport, SaysForWhichFrequenciesUnflexIsMade) {
  FastestOutcome outcome = with_unflex();
  outcome.freq_error = 0.1;
  EXPECT_THAT(to_text(outcome), HasSubstr("but unflex for up to 10 % off"));
}

TEST(FastestReport, TellsMinutesApart) {
  FastestOutcome outcome = with_unflex();
  outcome.at_feed_s = 61.96;
  EXPECT_THAT(to_text(outcome), HasSubstr("always at F         1:02.0    1:02.0\n"));
}

TEST(FastestReport, IsAPageWithATableAndOnePicture) {
  const FastestOutcome outcome = with_unflex();
  const std::string page = to_html(outcome);
  EXPECT_THAT(page, ::testing::StartsWith("<!DOCTYPE html>"));
  EXPECT_THAT(page, HasSubstr("&lt;print&gt;.gcode"));
  EXPECT_THAT(page, Not(HasSubstr("<print>")));
  EXPECT_THAT(page, HasSubstr("<th>20 µm</th><th>10 µm</th>"));
  EXPECT_THAT(page, HasSubstr("<tr class=\"unflex\"><th scope=\"row\">unflex</th><td>1.25</td>"
                              "<td class=\"none\">—</td></tr>"));
  const std::size_t plot = page.find("<svg class=\"plot\"");
  ASSERT_NE(plot, std::string::npos);
  EXPECT_EQ(page.find("<svg class=\"plot\"", plot + 1), std::string::npos);
  // A line in the legend for each contender, and one for length over F.
  for (const char* label : {"no shaper", "ZV", "MZV", "EI", "unflex", "length / F"}) {
    EXPECT_THAT(page, HasSubstr("</svg> " + std::string(label) + "</span>"));
  }
}

}  // namespace
}  // namespace unflex::study
