// Random programs, compensated and verified. UNFLEX_RANDOM_PROGRAMS is their number per firmware,
// UNFLEX_RANDOM_SEED the first seed.
#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <string>
#include <string_view>
#include <vector>

#include "jobs.hpp"
#include "own_limits.hpp"
#include "random_program.hpp"
#include "same_print.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/gcode/command.hpp"
#include "unflex/gcode/compensable.hpp"

namespace unflex::flow {
namespace {

using testing::JobFolder;
using testing::RandomProgram;

constexpr unsigned kPrograms = 35;
// Coordinates are written with four decimals, filament with five and a remainder.
constexpr double kPosition_mm = 0.6e-4;
constexpr double kFilament_mm = 2e-5;

unsigned from_environment(const char* name, unsigned otherwise) {
  const char* const text = std::getenv(name);
  return text == nullptr ? otherwise : static_cast<unsigned>(std::strtoul(text, nullptr, 10));
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size() - 1) + 1;
    lines.push_back(text.substr(begin, end - begin));
    begin = end;
  }
  return lines;
}

bool is_motion(const std::string& line) {
  const gcode::Command command = gcode::parse(std::string_view(line).substr(0, line.find('\n')));
  return command.kind == gcode::CommandKind::traditional && command.letter == 'G' &&
         command.number <= 3;
}

// The line; for M73, whose duration may differ, only the command.
std::string but_for_durations(const std::string& line) {
  return line.starts_with("M73 ") ? "M73" : line;
}

// All lines of the input without motion are in the output, in their order.
void expect_commands_kept(const std::string& input, const std::string& output) {
  const std::vector<std::string> out = lines_of(output);
  auto next = out.begin();
  for (const std::string& line : lines_of(input)) {
    if (is_motion(line)) {
      continue;
    }
    next = std::find_if(next, out.end(), [&](const std::string& there) {
      return but_for_durations(there) == but_for_durations(line);
    });
    ASSERT_NE(next, out.end()) << "lost: " << line;
    ++next;
  }
}

gcode::ModalState end_of(const std::string& text, Firmware firmware) {
  gcode::InterpreterOptions options = gcode::default_options(firmware);
  options.firmware_retraction = true;
  options.retract_length_mm = 0.8;
  gcode::Interpreter interpreter(options);
  for (const std::string& line : lines_of(text)) {
    static_cast<void>(interpreter.interpret({line, 0}));
  }
  return interpreter.state();
}

void expect_same_end(const std::string& input, const std::string& output, Firmware firmware) {
  const gcode::ModalState in = end_of(input, firmware);
  const gcode::ModalState out = end_of(output, firmware);
  for (const gcode::Axis axis : {gcode::X, gcode::Y, gcode::Z}) {
    EXPECT_NEAR(out.position_mm[axis], in.position_mm[axis], kPosition_mm);
    EXPECT_EQ(out.known[axis], in.known[axis]);
  }
  EXPECT_NEAR(out.position_mm[gcode::E], in.position_mm[gcode::E], kFilament_mm);
  EXPECT_NEAR(out.feed_mm_s, in.feed_mm_s, 1e-6);
  EXPECT_EQ(out.absolute_xyz, in.absolute_xyz);
  EXPECT_EQ(out.absolute_e, in.absolute_e);
  EXPECT_EQ(out.unit_mm, in.unit_mm);
}

struct Counts {
  std::size_t runs = 0;
  std::size_t kept = 0;
  std::size_t blamed = 0;  // kept runs whose fault only verification found
};

void expect_faultless(Firmware firmware, unsigned seed, Counts& counts) {
  SCOPED_TRACE(fmt::format("{}, UNFLEX_RANDOM_SEED={}", to_string(firmware), seed));
  const RandomProgram program = testing::random_program(firmware, seed);
  const std::string text = unflex::testing::numbered(program.text);
  const JobFolder folder(text, program.overrides);
  Job job = folder.job();
  job.engine = EngineChoice::banded;
  SilentProgress progress;
  const Result<report::Report> report = compensate(job, progress);
  if (!report) {
    ADD_FAILURE() << to_string(report.error());
    return;
  }
  EXPECT_EQ(report->violation_count, 0U) << testing::complaints(*report);
  const std::string output = folder.output();
  expect_commands_kept(text, output);
  expect_same_end(text, output, firmware);
  EXPECT_EQ(unflex::testing::difference(text, output, unflex::testing::printer_with(job.settings)),
            "");
  counts.runs += report->runs.total;
  counts.kept += report->runs.fallback;
  for (const report::Fallback& fallback : report->runs.fallbacks) {
    if (fallback.reason.starts_with("when it was verified")) {
      ++counts.blamed;
      std::cout << fmt::format("{} {}: {}\n", to_string(firmware), seed, fallback.reason);
    }
  }
}

class RandomPrograms : public ::testing::TestWithParam<Firmware> {};

TEST_P(RandomPrograms, AreCompensatedWithoutFault) {
  const unsigned first = from_environment("UNFLEX_RANDOM_SEED", 1);
  const unsigned count = from_environment("UNFLEX_RANDOM_PROGRAMS", kPrograms);
  Counts counts;
  for (unsigned seed = first; seed < first + count; ++seed) {
    expect_faultless(GetParam(), seed, counts);
  }
  RecordProperty("runs", static_cast<int>(counts.runs));
  RecordProperty("kept", static_cast<int>(counts.kept));
  RecordProperty("blamed", static_cast<int>(counts.blamed));
  EXPECT_LE(static_cast<double>(counts.blamed), 0.03 * static_cast<double>(counts.runs) + 1.0);
  // Most runs must be compensated, because a file with all runs kept would be faultless too.
  EXPECT_LT(static_cast<double>(counts.kept), 0.2 * static_cast<double>(counts.runs));
}

// Programs that once failed this test.

TEST(RandomProgramsFoundFaulty, WhereARunIsEnteredFromKeptMotionAtSpeed) {
  Counts counts;
  expect_faultless(Firmware::rrf, 10038, counts);
  expect_faultless(Firmware::klipper, 5075, counts);
}

TEST(RandomProgramsFoundFaulty, WhereMarlinLeavesTheMoveBeforeARunToItsFirstLine) {
  Counts counts;
  for (const unsigned seed : {5050U, 10121U, 10809U}) {
    expect_faultless(Firmware::marlin, seed, counts);
  }
}

TEST(RandomProgramsFoundFaulty, WhereAQuickRunHasLongLinesAroundACommand) {
  Counts counts;
  expect_faultless(Firmware::rrf, 31010, counts);
  expect_faultless(Firmware::marlin, 30345, counts);
}

TEST(RandomProgramsFoundFaulty, WhereTheClockOfARunIsLate) {
  Counts counts;
  expect_faultless(Firmware::marlin, 10058, counts);
  expect_faultless(Firmware::rrf, 10393, counts);
  expect_faultless(Firmware::rrf, 10641, counts);
}

TEST(RandomProgramsFoundFaulty, WhereAWipePullsItsFilamentBackAtItsEnd) {
  Counts counts;
  expect_faultless(Firmware::marlin, 50785, counts);
}

TEST(RandomProgramsFoundFaulty, WhereMarlinLeavesTheWipeBeforeARunToItsFirstLine) {
  Counts counts;
  expect_faultless(Firmware::marlin, 600674, counts);
}

INSTANTIATE_TEST_SUITE_P(Of, RandomPrograms,
                         ::testing::Values(Firmware::klipper, Firmware::marlin, Firmware::rrf),
                         [](const auto& tested) { return std::string(to_string(tested.param)); });

}  // namespace
}  // namespace unflex::flow
