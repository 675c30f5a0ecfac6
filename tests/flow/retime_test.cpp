#include "retime.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "unflex/core/number.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/platform/files.hpp"

namespace unflex::flow {
namespace {

class Retime : public ::testing::Test {
 protected:
  // The result of retime() for this content.
  static std::string retimed(const std::string& content, double factor,
                             const std::vector<verify::TimeNote>& notes = {}) {
    const auto text = memory_store(content);
    EXPECT_TRUE(retime(*text, "retime.gcode", notes, {0, 1000.0, 1000.0 * factor}));
    return {std::istreambuf_iterator<char>(*text->read()), {}};
  }
};

TEST_F(Retime, KeepsLineEndingsAndEverythingElse) {
  EXPECT_EQ(retimed("M73 P0 R98\r\nG1 X1\r\n\r\n;TIME:10", 2.0),
            "M73 P0 R196\r\nG1 X1\r\n\r\n;TIME:20");
  EXPECT_EQ(retimed("", 2.0), "");
  EXPECT_EQ(retimed("\n\n", 2.0), "\n\n");
}

TEST_F(Retime, FilesOfManyChunksThatGrowAndShrink) {
  std::string content;
  std::string longer;
  std::string shorter;
  // Over 3 MB of lines that all grow or shrink.
  for (int i = 0; i < 150'000; ++i) {
    content += "M73 P0 R50\nG1 X1 Y2\n";
    longer += "M73 P0 R500\nG1 X1 Y2\n";
    shorter += "M73 P0 R5\nG1 X1 Y2\n";
  }
  EXPECT_TRUE(retimed(content, 10.0) == longer);
  EXPECT_TRUE(retimed(content, 0.1) == shorter);
  EXPECT_TRUE(retimed(content, 1.0) == content);
}

// A print of 1000 s that takes 700: its first half takes as long as sliced.
TEST_F(Retime, GoesByWhatIsGoneAndWhatIsLeft) {
  const std::string content =
      ";TIME:1000\nM73 P0 R100\n;TIME_ELAPSED:500.0\nM73 P50 R50\nG1 X1\n;TIME_ELAPSED:995.0\nM73 "
      "P99 R10\n";
  const std::vector<verify::TimeNote> notes = {
      {1, 0.0, 0.0}, {2, 0.0, 0.0}, {3, 500.0, 500.0}, {4, 500.0, 500.0}, {6, 995.0, 698.0}};
  EXPECT_EQ(retimed(content, 0.7, notes),
            ";TIME:700\nM73 P0 R70\n;TIME_ELAPSED:500.0\nM73 P50 R20\nG1 X1\n;TIME_ELAPSED:698.0\n"
            "M73 P99 R7\n")
      << "the last line has no note";
  const gcode::TimeFactors at_end = factors_at({7, 995.0, 698.0}, {0, 1000.0, 700.0});
  EXPECT_DOUBLE_EQ(at_end.left, 0.7) << "5 s say nothing";
  EXPECT_DOUBLE_EQ(at_end.gone, 698.0 / 995.0);
}

// Slow lines, which stay as they are, and then corners, which become faster.
TEST_F(Retime, FollowsAFreeTiming) {
  std::string print = "G28\nG90\nM83\nG1 X20 Y20 Z0.2 F6000\n";
  for (int i = 0; i < 8; ++i) {
    print += i % 2 == 0 ? "G1 X60 E1 F1200\n" : "G1 X20 E1 F1200\n";
  }
  print += ";TIME_ELAPSED:16.00\n";
  for (int i = 0; i < 160; ++i) {
    print += i % 2 == 0 ? "G1 X26 Y26 E.2 F12000\n" : "G1 X20 Y26 E.2\nG1 Y20 E.2\n";
  }
  print += ";TIME_ELAPSED:30.00\nM84\n";
  const testing::JobFolder folder(
      print, {"timing.tolerance_um=50", "dynamics.freq_error=0", "limits.max_accel_mm_s2=1500"});
  SilentProgress progress;
  const Result<report::Report> report = compensate(folder.job(), progress);
  ASSERT_TRUE(report) << to_string(report.error());
  const double factor = report->measured.compensated.time_s / report->measured.uncompensated.time_s;
  EXPECT_LT(factor, 0.95) << testing::complaints(*report)
                          << (report->free_timing.as_sliced.empty()
                                  ? std::string()
                                  : report->free_timing.as_sliced[0].reason);
  const std::string output = folder.output();
  const auto elapsed_s = [&](std::size_t from) {
    const std::size_t at = output.find(";TIME_ELAPSED:", from) + sizeof(";TIME_ELAPSED:") - 1;
    return std::pair(at, *parse_number(output.substr(at, output.find('\n', at) - at)));
  };
  const auto [first_at, first_s] = elapsed_s(0);
  const auto [last_at, last_s] = elapsed_s(first_at);
  EXPECT_NEAR(first_s, 16.0, 1.0) << "not " << 16.0 * factor;
  EXPECT_NEAR(last_s, 30.0 * factor, 0.5);
}

TEST_F(Retime, FailsWithoutAFile) {
  const auto missing = platform::file_store("/nonexistent/file.gcode");
  const Status status = retime(*missing, "out.gcode", {}, {0, 1.0, 1.0});
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(to_string(status.error()).rfind("out.gcode", 0), 0U);
}

}  // namespace
}  // namespace unflex::flow
