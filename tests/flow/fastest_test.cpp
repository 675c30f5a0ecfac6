// The README's table of how fast a print may go.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "container/packed.hpp"
#include "jobs.hpp"
#include "paths.hpp"
#include "unflex/study/study_fastest.hpp"

namespace unflex::flow::testing {
namespace {

// The figures of the README's row that begins so.
std::vector<double> figures_of(const std::string& page, const std::string& row) {
  const std::size_t begin = page.find("| " + row + " |");
  EXPECT_NE(begin, std::string::npos) << row;
  const std::size_t cells = begin + row.size() + 3;
  std::string text = page.substr(cells, page.find('\n', begin) - cells);
  std::ranges::replace_if(
      text, [](char c) { return c != '.' && std::isdigit(static_cast<unsigned char>(c)) == 0; },
      ' ');
  std::istringstream stream(text);
  return {std::istream_iterator<double>(stream), {}};
}

void expect_as_told(const std::string& row, const std::vector<double>& told,
                    const std::vector<double>& found) {
  ASSERT_EQ(told.size(), found.size()) << row;
  for (std::size_t i = 0; i < told.size(); ++i) {
    EXPECT_NEAR(found[i], told[i], 0.01 * told[i]) << row;
  }
}

study::FastestOutcome how_fast(const std::string& print, const std::vector<double>& tolerances_mm,
                               const std::string& method) {
  const JobFolder folder(
      print, {"timing.method=" + method, "dynamics.x.freq_hz=45", "dynamics.x.damping_ratio=0.06",
              "dynamics.y.freq_hz=45", "dynamics.y.damping_ratio=0.06", "printer.firmware=klipper",
              "base.max_accel_mm_s2=20000"});
  Job job = folder.job(2);
  job.settings = study::settings_of_fastest(job.settings);
  SilentProgress progress;
  auto outcome = study::study_fastest(job, tolerances_mm, {}, progress);
  EXPECT_TRUE(outcome) << to_string(outcome.error());
  return std::move(*outcome);
}

// "Ten layers at 60 mm/s take 20:21.0 min within 20 µm, 20:20.0 with ZV, and 20:05.6 always at F."
TEST(HowFast, OfSlowWallsIsAsTheReadmeSays) {
  const study::FastestOutcome outcome =
      how_fast(container::ten_layers("wallring"), {0.02}, "scaled");
  EXPECT_NEAR(outcome.contenders[4].at[0].value().time_s, 1221.0, 1.0);
  EXPECT_NEAR(outcome.contenders[1].at[0].value().time_s, 1220.0, 1.0);
  EXPECT_NEAR(outcome.at_feed_s, 1205.6, 1.0);
}

TEST(HowFast, IsAsTheReadmeSays) {
  const study::FastestOutcome outcome =
      how_fast(read_file(std::filesystem::path(test_paths::kData) / "study_fasttower.gcode"),
               {0.005, 0.01, 0.02, 0.05, 0.1}, "optimal");
  const std::string page = read_file(std::filesystem::path(test_paths::kDocs) / ".." / "README.md");
  ASSERT_EQ(outcome.contenders.size(), 5U);
  for (const study::FastestOfContender& contender : outcome.contenders) {
    std::vector<double> times_s;
    for (const auto& motion : contender.at) {
      ASSERT_TRUE(motion) << contender.name;
      times_s.push_back(motion->time_s);
    }
    expect_as_told(contender.name, figures_of(page, contender.name), times_s);
  }
  expect_as_told("always at F", figures_of(page, "always at F"),
                 std::vector<double>(5, outcome.at_feed_s));
  const std::vector<double> told_percent = figures_of(page, "unflex saves");
  ASSERT_EQ(told_percent.size(), 5U);
  for (std::size_t i = 0; i < told_percent.size(); ++i) {
    // The times may each be 1 % off.
    EXPECT_NEAR(100.0 * outcome.unflex_saves(i).value(), told_percent[i], 1.5);
  }
  // "As sliced it takes 9.81 s, and the nozzle strays up to 220 µm."
  EXPECT_NEAR(outcome.as_sliced.time_s, 9.81, 0.01 * 9.81);
  EXPECT_NEAR(outcome.as_sliced.errors.max_mm, 0.220, 0.01 * 0.220);
}

}  // namespace
}  // namespace unflex::flow::testing
