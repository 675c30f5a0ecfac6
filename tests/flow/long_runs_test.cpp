// Runs that are too long to be handled as a whole, mostly spiral vases.
#include <fcntl.h>
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "compensate_with.hpp"
#include "engines.hpp"
#include "jobs.hpp"
#include "unflex/core/number.hpp"
#include "unflex/platform/descriptors.hpp"
#include "unflex/run/piece_reader.hpp"

namespace unflex::flow {
namespace {

using testing::factory;
using ::testing::HasSubstr;
using testing::JobFolder;

// The printer does not stop between these runs, so neither can be compensated without the other.
TEST(LongRuns, AreLeftWhereTheyMeetAtTooManyLinesWithoutMotion) {
  std::string text = "G28\nG90\nM83\nG1 X20 Y20 Z0.4 F6000\nG4 P0\nG1 X60 Y20 E1\n";
  for (int i = 0; i < 30'000; ++i) {
    text += "; nothing\n";
  }
  text += "G1 X90 Y25 E1\nG1 E-1\nG1 X60 Y60\nG1 E1\nM84\n";
  const JobFolder folder(text);
  std::string first;
  for (const unsigned workers : {1U, 3U}) {
    SilentProgress progress;
    const Result<report::Report> report = compensate(folder.job(workers), progress);
    ASSERT_TRUE(report.has_value()) << to_string(report.error());
    EXPECT_EQ(report->violation_count, 0U) << testing::complaints(*report);
    EXPECT_EQ(report->runs.total, 3U);
    EXPECT_EQ(report->runs.fallback, 2U) << testing::complaints(*report);
    EXPECT_EQ(report->runs.compensated, 1U);
    EXPECT_THAT(testing::complaints(*report), HasSubstr("too many lines without motion"));
    first = first.empty() ? folder.output() : first;
    EXPECT_EQ(folder.output(), first);
  }
  EXPECT_THAT(first, HasSubstr("\nG1 X60 Y20 E1\n; nothing\n"));
  EXPECT_THAT(first, HasSubstr("; nothing\nG1 X90 Y25 E1\n"));
}

// A lobed spiral that rises and widens without a stop, with lines without motion in it.
std::string spiral(double duration_s) {
  constexpr double kSpeed_mm_s = 40.0;
  constexpr double kStep_mm = 1.5;
  std::string text = "G28\nG90\nM83\nG1 Z0.4 F6000\nG1 X100 Y100\nG4 P1000\n";
  double angle = 0.0;
  double z_mm = 0.4;
  double done_mm = 0.0;
  double radius_mm = 20.0;
  for (int i = 0; done_mm < duration_s * kSpeed_mm_s; ++i) {
    radius_mm += 0.002;
    angle += kStep_mm / radius_mm;
    const double r = radius_mm * (1.0 + 0.1 * std::sin(9.0 * angle));
    z_mm += 0.2 * kStep_mm / (2.0 * std::numbers::pi * radius_mm);
    text += fmt::format("G1 X{:.3f} Y{:.3f} Z{:.4f} E0.05 F2400\n", 100.0 + r * std::cos(angle),
                        100.0 + r * std::sin(angle), z_mm);
    done_mm += kStep_mm;
    if (i % 90 == 0) {
      text += fmt::format("M106 S{}\n;LAYER {}\n", i / 90, i);
    }
  }
  return text + "G1 E-0.8 F2400\nM84\n";
}

std::vector<run::Piece> pieces_of(const std::string& text) {
  std::istringstream stream(text);
  run::PieceReader reader(stream, "in.gcode", {}, {}, {});
  std::vector<run::Piece> pieces;
  for (run::Piece piece; reader.next(piece).value(); piece = {}) {
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

TEST(LongRun, ComesInPartsThatMakeUpTheWhole) {
  const std::string text = spiral(130.0);
  const std::vector<run::Piece> pieces = pieces_of(text);
  std::string all;
  std::vector<const run::Piece*> parts;
  for (const run::Piece& piece : pieces) {
    for (const gcode::Event& event : piece.events) {
      all += event.line.text;
    }
    if (piece.is_run && piece.moves.size() > 10) {
      parts.push_back(&piece);
    }
  }
  EXPECT_EQ(all, text);
  ASSERT_GE(parts.size(), 5U);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const run::Piece& part = *parts[i];
    EXPECT_EQ(part.begins_run(), i == 0);
    EXPECT_EQ(part.ends_run(), i + 1 == parts.size());
    std::size_t counted = 0;
    for (const std::size_t count : part.move_counts) {
      counted += count;
    }
    EXPECT_EQ(counted, part.moves.size());
    EXPECT_LT(planner::duration_s(part.moves), 45.0);
    if (i > 0) {
      const run::Piece& before = *parts[i - 1];
      EXPECT_GT(planner::duration_s(before.moves), 19.9);
      EXPECT_GT(planner::duration_s(part.before), 0.25);
      EXPECT_GT(planner::duration_s(before.after), 0.25);
      EXPECT_EQ(part.before.back().segment.line, before.moves.back().segment.line);
      EXPECT_EQ(before.after.front().segment.line, part.moves.front().segment.line);
      // The machine does not stop between them.
      EXPECT_GT(part.moves.front().start_v_mm_s, 10.0);
      EXPECT_EQ(part.moves.front().start_v_mm_s, before.moves.back().end_v_mm_s);
    }
  }
}

TEST(LongRun, OfLessThanAMinuteStaysWhole) {
  std::size_t runs = 0;
  for (const run::Piece& piece : pieces_of(spiral(35.0))) {
    runs += piece.is_run ? 1 : 0;
    EXPECT_TRUE(!piece.is_run || (piece.begins_run() && piece.ends_run()));
  }
  EXPECT_EQ(runs, 1U);
}

class LongRunOn : public ::testing::TestWithParam<const char*> {};

TEST_P(LongRunOn, IsCompensatedWithoutASeam) {
  const JobFolder folder(spiral(75.0), {fmt::format("printer.firmware=\"{}\"", GetParam())});
  SilentProgress progress;
  const Result<report::Report> report = compensate(folder.job(2), progress);
  ASSERT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_EQ(report->violation_count, 0U) << testing::complaints(*report);
  EXPECT_EQ(report->runs.total, 1U);
  EXPECT_EQ(report->runs.fallback, 0U) << testing::complaints(*report);
  EXPECT_TRUE(report->warnings.empty());
  const auto& before = testing::unshaped(*report).extruding;
  const auto& after = report->measured.compensated.extruding;
  EXPECT_LT(after.contour_rms_mm, 0.25 * before.contour_rms_mm);
  EXPECT_LT(after.contour_max_mm, before.contour_max_mm);
  // Klipper stops for 10.5 ms when its shaper is switched off, and again when it is switched on.
  EXPECT_NEAR(report->measured.compensated.time_s, report->measured.uncompensated.time_s, 0.03);
  EXPECT_NEAR(report->measured.compensated.extrusion_mm,
              report->measured.uncompensated.extrusion_mm, 1e-5);
  // One run: its marks come once, and nothing is restored between its parts.
  const std::string output = folder.output();
  const auto count = [&](std::string_view what) {
    std::size_t found = 0;
    for (std::size_t at = output.find(what); at != std::string::npos;
         at = output.find(what, at + 1)) {
      ++found;
    }
    return found;
  };
  EXPECT_EQ(count(";unflex run"), 1U);
  EXPECT_EQ(count(";unflex end"), 1U);
}

INSTANTIATE_TEST_SUITE_P(Each, LongRunOn, ::testing::Values("klipper", "marlin", "rrf"),
                         [](const auto& each) { return std::string(each.param); });

TEST(LongRun, IsTheSameForAnyNumberOfWorkers) {
  const JobFolder folder(spiral(90.0));
  SilentProgress progress;
  ASSERT_TRUE(compensate(folder.job(1), progress).has_value());
  const std::string output = folder.output();
  ASSERT_TRUE(compensate(folder.job(3), progress).has_value());
  EXPECT_EQ(folder.output(), output);
}

// Solves windows that stay within this position, and fails for others.
testing::Solve up_to(double most_mm) {
  return [most_mm](const compensate::AxisWindow& window) -> Result<compensate::AxisSolution> {
    if (*std::ranges::max_element(window.reference_mm) > most_mm) {
      return fail(ErrorKind::internal, "too far out");
    }
    return compensate::make_banded_engine()->solve(window);
  };
}

TEST(LongRun, StandsAsAWholeWhenItsBeginningDoes) {
  const std::string text = spiral(90.0);
  const JobFolder folder(text);
  SilentProgress progress;
  const Result<report::Report> report =
      compensate_with(folder.job(2), {factory(up_to(110.0)), nullptr}, progress);
  ASSERT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_EQ(report->violation_count, 0U) << testing::complaints(*report);
  EXPECT_EQ(report->runs.fallback, 1U);
  EXPECT_THAT(folder.output(), HasSubstr(text.substr(text.find("F2400\n"))));
}

TEST(LongRun, ThatCannotGoOnStandsAsAWhole) {
  const std::string text = spiral(90.0);
  const JobFolder folder(text);
  SilentProgress progress;
  const Result<report::Report> report =
      compensate_with(folder.job(2), {factory(up_to(125.0)), nullptr}, progress);
  ASSERT_TRUE(report.has_value()) << to_string(report.error());
  EXPECT_EQ(report->violation_count, 0U) << testing::complaints(*report);
  EXPECT_EQ(report->runs.total, 1U);
  EXPECT_EQ(report->runs.fallback, 1U);
  ASSERT_FALSE(report->runs.fallbacks.empty());
  EXPECT_THAT(report->runs.fallbacks.front().reason, HasSubstr("too far out"));
  EXPECT_THAT(folder.output(), HasSubstr(text.substr(text.find("F2400\n"))));
}

TEST(LongRun, ThatCannotGoOnIsAnErrorWithItsLinesWhereItsBeginningIsPassedOn) {
  const JobFolder folder(spiral(90.0));
  Job job = folder.job(2);
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  job.output_stream = platform::descriptor_sink(nowhere);
  SilentProgress progress;
  const Result<report::Report> report =
      compensate_with(job, {factory(up_to(125.0)), nullptr}, progress);
  ::close(nowhere);
  ASSERT_FALSE(report.has_value());
  EXPECT_GT(report.error().place.line, 100U);
  EXPECT_THAT(report.error().message, HasSubstr("too far out"));
  EXPECT_THAT(report.error().message, HasSubstr("write to a file"));
}

}  // namespace
}  // namespace unflex::flow
