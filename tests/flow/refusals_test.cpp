// Inputs that every command refuses, with equal messages.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <string>

#include "core/stopped_progress.hpp"
#include "jobs.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/platform/files.hpp"
#include "unflex/study/study_print.hpp"

namespace unflex::flow {
namespace {

using testing::JobFolder;

const std::string kPrint =
    "G28\nG90\nM83\nG1 Z0.2 F600\nG1 X20 Y20 F6000\nG1 X26 Y20 E0.24 F3000\nG1 X26 Y26 E0.24\n"
    "G1 X20 Y26 E0.24\nM107\n";

struct Task {
  std::string name;
  std::function<Status(const Job&, Progress&)> run;
};

void PrintTo(const Task& task, std::ostream* out) { *out << task.name; }

constexpr auto kForget = [](const auto&) {};

class EveryTask : public ::testing::TestWithParam<Task> {
 protected:
  // The error, "file: message".
  static std::string refusal(const Job& job, Progress& progress) {
    const Status status = GetParam().run(job, progress);
    return status ? "no error" : to_string(status.error());
  }
  static std::string refusal(const Job& job) {
    SilentProgress progress;
    return refusal(job, progress);
  }
};

TEST_P(EveryTask, TakesTheFile) {
  const JobFolder folder(kPrint);
  folder.set_output(kPrint);
  EXPECT_EQ(refusal(folder.job()), "no error");
}

TEST_P(EveryTask, NeedsAFileThatIsThere) {
  const JobFolder folder(kPrint);
  folder.set_output(kPrint);
  Job job = folder.job();
  job.input = platform::file_store(folder.path() / "missing");
  job.input_name = "print";
  EXPECT_EQ(refusal(job), "print: cannot read the file");
}

TEST_P(EveryTask, StopsWhenItIsTold) {
  const JobFolder folder(kPrint);
  folder.set_output(kPrint);
  unflex::testing::StoppedProgress progress;
  EXPECT_EQ(refusal(folder.job(), progress), "cancelled");
}

// A print that would hardly ever end is a slip in the file.
TEST_P(EveryTask, RefusesAMoveOfHours) {
  const std::string text = kPrint + "G1 X10 F0.001\nG1 X20 F6000\n";
  const JobFolder folder(text);
  folder.set_output(text);
  Job job = folder.job();
  job.input_name = job.output_name = "print";
  EXPECT_EQ(refusal(job),
            "print:10: this move would take 167 hours; check its length, its F and the limits");
}

INSTANTIATE_TEST_SUITE_P(
    Of, EveryTask,
    ::testing::Values(
        Task{"Compensate",
             [](const Job& job, Progress& p) { return compensate(job, p).map(kForget); }},
        Task{"Verify", [](const Job& job, Progress& p) { return verify(job, p).map(kForget); }},
        Task{"Inspect", [](const Job& job, Progress& p) { return inspect(job, p).map(kForget); }},
        Task{"Study", [](const Job& job,
                         Progress& p) { return study::study_print(job, false, p).map(kForget); }}),
    [](const auto& task) { return task.param.name; });

TEST(Verify, NeedsAnOutputThatIsThere) {
  const JobFolder folder(kPrint);
  Job job = folder.job();
  job.output_name = "made";
  SilentProgress progress;
  const Result<report::Report> report = verify(job, progress);
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(to_string(report.error()), "made: cannot read the file");
}

// A compensated file measured against itself would look perfect.
TEST(Verify, RefusesWhatWasCompensatedAsTheMeasure) {
  const JobFolder folder(kPrint);
  SilentProgress progress;
  ASSERT_TRUE(compensate(folder.job(), progress));
  ASSERT_TRUE(verify(folder.job(), progress));
  Job job = folder.job();
  job.input = job.output;
  job.input_name = "made";
  const Result<report::Report> report = verify(job, progress);
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().kind, ErrorKind::input);
  EXPECT_THAT(to_string(report.error()),
              ::testing::MatchesRegex("made:[0-9]+: this file was already compensated by unflex; "
                                      "give the file as it was sliced, and .*"));
}

}  // namespace
}  // namespace unflex::flow
