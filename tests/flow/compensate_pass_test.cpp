// One pass over a print by itself.
#include "compensate_pass.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>
#include <string>

#include "engines.hpp"
#include "jobs.hpp"
#include "unflex/compensate/axis_window.hpp"

namespace unflex::flow {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

const std::string kHead = "G28\nG90\nM83\nG1 X50 Y50 Z0.2 F6000\n";
const std::string kThere = "G1 X80 E1\nG1 Y80 E1\n";
const std::string kBack = "G1 X50 E1\nG1 Y50 E1\n";
const std::string kPrint = kHead + kThere + "G4 P500\n" + kBack;

struct Pass {
  PassOutcome outcome;
  std::string output;
  report::Report report;
};

class Stopped final : public Progress {
 public:
  void update(std::string_view, double) override {}
  [[nodiscard]] bool cancelled() const override { return true; }
};

Engines banded() { return {compensate::make_banded_engine, {}}; }

Pass pass_over(const std::string& text, const Engines& engines,
               const std::vector<verify::BlamedRun>& kept = {}, unsigned workers = 1) {
  const testing::JobFolder folder(text);
  const Job job = folder.job(workers);
  Result<WorkerPool> processes = WorkerPool::start(engines.threaded ? 0 : workers, engines.second);
  EXPECT_TRUE(processes.has_value());
  CpuSlots slots(workers);
  std::istringstream input(text);
  std::ostringstream output;
  SilentProgress progress;
  Pass pass;
  pass.outcome = compensate_pass(job, engines, kept, {input, output, *processes, slots, [] {}},
                                 progress, pass.report);
  pass.output = output.str();
  return pass;
}

TEST(CompensatePass, WritesEachRunAndMeasuresAll) {
  const Pass pass = pass_over(kPrint, banded());
  ASSERT_TRUE(pass.outcome.status.has_value()) << to_string(pass.outcome.status.error());
  EXPECT_THAT(pass.outcome.blamed, SizeIs(0));
  EXPECT_THAT(pass.output, HasSubstr("\nG4 P500\n"));
  EXPECT_EQ(pass.report.runs.total, 2U);
  EXPECT_EQ(pass.report.runs.compensated, 2U);
  EXPECT_EQ(pass.report.violation_count, 0U) << testing::complaints(pass.report);
  EXPECT_EQ(pass.report.runs.windows_total, pass.report.runs.windows_solved);
  EXPECT_LT(pass.report.measured.compensated.extruding.contour_rms_mm,
            0.1 * testing::unshaped(pass.report).extruding.contour_rms_mm);
}

TEST(CompensatePass, WritesTheSameForAnyNumberOfWorkers) {
  const Pass one = pass_over(kPrint, banded());
  for (const unsigned workers : {2U, 5U}) {
    EXPECT_EQ(pass_over(kPrint, banded(), {}, workers).output, one.output);
  }
}

TEST(CompensatePass, LeavesTheRunsThatItIsTold) {
  const Pass pass = pass_over(kPrint, banded(), {{5, 6, "an earlier pass found it worse"}});
  ASSERT_TRUE(pass.outcome.status.has_value());
  EXPECT_THAT(pass.output, HasSubstr(kHead + kThere + "G4 P500\n"));
  EXPECT_THAT(pass.output, Not(HasSubstr(kBack)));
  ASSERT_THAT(pass.report.runs.fallbacks, SizeIs(1));
  EXPECT_EQ(pass.report.runs.fallbacks[0].reason, "an earlier pass found it worse");
}

TEST(CompensatePass, KeepsARunWhoseWindowsHaveNoSolution) {
  const Engines none = {testing::factory([](const compensate::AxisWindow&) {
                          return fail(ErrorKind::internal, "none found");
                        }),
                        {}};
  const Pass pass = pass_over(kPrint, none);
  ASSERT_TRUE(pass.outcome.status.has_value());
  EXPECT_EQ(pass.output, kPrint);
  EXPECT_EQ(pass.report.runs.fallback, 2U);
  EXPECT_EQ(pass.report.runs.windows_fallback, pass.report.runs.windows_total);
  EXPECT_THAT(pass.report.runs.fallbacks[0].reason, HasSubstr("none found"));
}

// Processes solve one axis of a window at a time and answer in any order.
TEST(CompensatePass, WritesTheSameWhereProcessesSolve) {
  const Pass threads = pass_over(kPrint, banded());
  const Pass processes = pass_over(kPrint, {{}, compensate::make_banded_engine}, {}, 3);
  ASSERT_TRUE(processes.outcome.status.has_value());
  EXPECT_EQ(processes.output, threads.output);
}

TEST(CompensatePass, EndsWithTheLineThatCannotBeRead) {
  const Pass pass = pass_over(kHead + kThere + ";unflex run\n" + kBack, banded());
  ASSERT_FALSE(pass.outcome.status.has_value());
  EXPECT_EQ(pass.outcome.status.error().kind, ErrorKind::input);
  EXPECT_EQ(pass.outcome.status.error().place.line, 7U);
}

TEST(CompensatePass, EndsWhereTheUserStopsItOrNobodyTakesItsText) {
  const testing::JobFolder folder(kPrint);
  const Job job = folder.job();
  Result<WorkerPool> processes = WorkerPool::start(0, {});
  ASSERT_TRUE(processes.has_value());
  CpuSlots slots(1);
  report::Report report;
  {
    std::istringstream input(kPrint);
    std::ostringstream output;
    Stopped progress;
    const PassOutcome outcome = compensate_pass(
        job, banded(), {}, {input, output, *processes, slots, [] {}}, progress, report);
    ASSERT_FALSE(outcome.status.has_value());
    EXPECT_EQ(outcome.status.error().message, "cancelled");
  }
  {
    std::istringstream input(kPrint);
    std::ostringstream output;
    output.setstate(std::ios::badbit);
    SilentProgress progress;
    const PassOutcome outcome = compensate_pass(
        job, banded(), {}, {input, output, *processes, slots, [] {}}, progress, report);
    ASSERT_FALSE(outcome.status.has_value());
    EXPECT_EQ(outcome.status.error().place.file, "out.gcode");
  }
}

}  // namespace
}  // namespace unflex::flow
