// The threads beside the main thread.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <iterator>
#include <memory>
#include <string>
#include <string_view>
#include <thread>

#include "cpu_slots.hpp"
#include "gap_check.hpp"
#include "jobs.hpp"
#include "stream_buffers.hpp"
#include "task_pool.hpp"
#include "unflex/platform/descriptors.hpp"
#include "unflex/run/verify_rules.hpp"
#include "verify_thread.hpp"

namespace unflex::flow {
namespace {

using namespace std::chrono_literals;

TEST(TaskPool, CarriesOutEveryTaskAndNoMoreAtATimeThanThereAreSlots) {
  CpuSlots slots(2);
  std::atomic<int> done = 0;
  std::atomic<int> at_once = 0;
  std::atomic<int> most = 0;
  {
    TaskPool pool(4, slots);
    for (int i = 0; i < 40; ++i) {
      pool.submit([&] {
        const int now = ++at_once;
        for (int seen = most; now > seen && !most.compare_exchange_weak(seen, now);) {
        }
        std::this_thread::sleep_for(1ms);
        --at_once;
        ++done;
      });
    }
    while (done < 40) {
      std::this_thread::sleep_for(1ms);
    }
  }
  EXPECT_EQ(done, 40);
  EXPECT_EQ(most, 2);
}

TEST(TaskPool, DropsWhatIsLeftWhenItEnds) {
  CpuSlots slots(1);
  std::atomic<int> kBegun = 0;
  {
    TaskPool pool(1, slots);
    for (int i = 0; i < 1000; ++i) {
      pool.submit([&] {
        ++kBegun;
        std::this_thread::sleep_for(1ms);
      });
    }
  }
  EXPECT_LT(kBegun, 1000);
}

TEST(TaskPool, WithoutThreadsWorksAtOnce) {
  CpuSlots slots(1);
  TaskPool pool(0, slots);
  bool done = false;
  pool.submit([&] { done = true; });
  EXPECT_TRUE(done);
}

TEST(CpuSlot, IsFreeForOthersWhileItsHolderWaits) {
  CpuSlots slots(1);
  const CpuSlot slot(slots);
  bool done = false;
  std::jthread other;
  {
    const CpuSlot::Without without(slots);
    other = std::jthread([&] {
      const CpuSlot mine(slots);
      done = true;
    });
    other.join();
  }
  EXPECT_TRUE(done);
}

constexpr const char* kPrint =
    "G90\nM83\nG1 X50 Y50 Z0.4 F6000\nG1 X60 Y50 E0.5\nG1 X60 Y60 E0.5\nM84\n";

TEST(VerifyThread, FindsWhatVerifyingAfterwardsFinds) {
  CpuSlots slots(1);
  VerifyThread thread(run::verify_rules(testing::settings()), {}, "in", "out", slots);
  // Texts come in pieces that are no whole lines, and one text comes long before the other.
  const std::string text = kPrint;
  thread.push("", text.substr(0, 20));
  thread.push(text.substr(0, 33), text.substr(20));
  thread.push(text.substr(33), "");
  thread.end();
  const Result<verify::VerifyReport> result = thread.result();
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->violation_count, 0U);
  EXPECT_EQ(result->measured.output.lines, 6U);
  EXPECT_GT(result->measured.uncompensated.extruding.contour_max_mm, 0.01);
}

TEST(VerifyThread, IsBehindUntilItHasReadWhatItWasGiven) {
  CpuSlots slots(1);
  VerifyThread thread(run::verify_rules(testing::settings()), {}, "in", "out", slots);
  std::string long_text;
  while (long_text.size() < (5U << 20U)) {
    long_text += "; nothing that would take the machine anywhere\n";
  }
  {
    const CpuSlot slot(slots);  // the thread cannot work meanwhile
    thread.push(long_text, long_text);
    EXPECT_TRUE(thread.is_behind());
  }
  thread.end();
  ASSERT_TRUE(thread.result().has_value());
  EXPECT_FALSE(thread.is_behind());
}

TEST(VerifyThread, IsNotWaitedForWhileItWaitsForOneOfTheTexts) {
  CpuSlots slots(1);
  VerifyThread thread(run::verify_rules(testing::settings()), {}, "in", "out", slots);
  thread.push("", std::string(5U << 20U, '\n'));
  while (thread.is_behind()) {
    std::this_thread::sleep_for(1ms);
  }
}

// Bytes allocated on the heap.
std::size_t held_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

TEST(VerifyThread, DropsTheTextsOnceItHasEndedEarly) {
  CpuSlots slots(1);
  VerifyThread thread(run::verify_rules(testing::settings()), {}, "in", "out", slots);
  // A move that takes practically for ever.
  const std::string endless = std::string(kPrint) + "G1 X0 F0.001\nM400\n";
  thread.push(endless, endless);
  const std::string text(6U << 20U, ';');
  const std::size_t before = held_bytes();
  for (int i = 0; i < 20; ++i) {
    thread.push(text, text);
    const auto deadline = std::chrono::steady_clock::now() + 10s;
    while (thread.is_behind() && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(1ms);
    }
    ASSERT_FALSE(thread.is_behind());
  }
  EXPECT_LT(held_bytes(), before + 3 * text.size());
  thread.end();
  EXPECT_FALSE(thread.result().has_value());
}

TEST(TextQueue, HoldsNothingThatNobodyReads) {
  CpuSlots slots(1);
  TextQueue queue(slots);
  queue.push(std::string(5U << 20U, ';'));
  EXPECT_TRUE(queue.is_long());
  queue.drop();
  EXPECT_FALSE(queue.is_long());
  queue.push(std::string(5U << 20U, ';'));
  EXPECT_FALSE(queue.is_long());
}

// Cancelled from the beginning.
class CancelledProgress final : public Progress {
 public:
  void update(std::string_view /*stage*/, double /*fraction*/) override {}
  [[nodiscard]] bool cancelled() const override { return true; }
};

TEST(SinkBuffer, SaysWhereItWasCancelledBeforeAllWasWritten) {
  std::array<int, 2> pipe{};
  ASSERT_EQ(::pipe2(pipe.data(), O_NONBLOCK), 0);
  while (::write(pipe[1], "x", 1) == 1) {
  }
  CpuSlots slots(1);
  const CpuSlot slot(slots);
  Job job;
  job.output_stream = platform::descriptor_sink(pipe[1]);
  job.output_stream_kind = container::Kind::gzip;
  const CancelledProgress progress;
  SinkBuffer sink(job, progress, slots);
  EXPECT_FALSE(sink.finish());
  EXPECT_EQ(sink.error(), 0);
  ::close(pipe[0]);
  ::close(pipe[1]);
}

// Cancelled at once for the reading thread. For the main thread, cancelled when it asks a second
// time after its piece was written.
class CancelledInTheReader final : public Progress {
 public:
  void update(std::string_view /*stage*/, double /*fraction*/) override { is_written_ = true; }
  [[nodiscard]] bool cancelled() const override {
    return std::this_thread::get_id() != owner_ || (is_written_ && asked_since_++ > 0);
  }

 private:
  std::thread::id owner_ = std::this_thread::get_id();
  bool is_written_ = false;
  mutable int asked_since_ = 0;
};

TEST(Compensate, IsNotDoneWhereItsInputEndedForBeingCancelled) {
  const testing::JobFolder folder("");
  std::array<int, 2> pipe{};
  ASSERT_EQ(::pipe(pipe.data()), 0);
  // The pipe stays open: more could come.
  constexpr std::string_view kBegun = "G28\nM106 S9\n";
  ASSERT_EQ(::write(pipe[1], kBegun.data(), kBegun.size()), std::ssize(kBegun));
  Job job = folder.job();
  job.input_stream = platform::descriptor_source(pipe[0]);
  CancelledInTheReader progress;
  const Result<report::Report> report = compensate(job, progress);
  ASSERT_FALSE(report.has_value());
  EXPECT_EQ(report.error().message, "cancelled");
  ::close(pipe[0]);
  ::close(pipe[1]);
}

TEST(VerifyThread, EndsUnaskedWhenItIsNoLongerWanted) {
  CpuSlots slots(1);
  VerifyThread thread(run::verify_rules(testing::settings()), {}, "in", "out", slots);
  thread.push(kPrint, kPrint);
}

// Jobs with these numbers of windows, like those the reader makes.
std::vector<std::unique_ptr<run::RunJob>> jobs(const std::vector<std::size_t>& windows) {
  std::vector<std::unique_ptr<run::RunJob>> result;
  for (const std::size_t count : windows) {
    result.push_back(std::make_unique<run::RunJob>());
    result.back()->windows.spans.resize(count);
  }
  return result;
}

// Which axes of windows are chosen as probes in a file of so many windows, in the order of the
// slots.
std::vector<std::size_t> chosen(const std::vector<std::size_t>& windows) {
  GapCheck check;
  std::size_t before = 0;
  for (const std::unique_ptr<run::RunJob>& job : jobs(windows)) {
    check.choose(*job);
    for (run::Probe& probe : job->windows.probes) {
      probe.solution.iterations = static_cast<int>(2 * (before + probe.window) + probe.axis);
    }
    before += job->windows.spans.size();
    check.take(*job);
  }
  std::vector<std::size_t> result;
  for (const run::Probe& probe : check.probes()) {
    result.push_back(static_cast<std::size_t>(probe.solution.iterations));
  }
  return result;
}

TEST(GapCheck, TakesEverythingOfASmallFile) {
  EXPECT_EQ(chosen({1, 2}), (std::vector<std::size_t>{0, 1, 2, 3, 4, 5}));
}

TEST(GapCheck, TakesAFixedSampleOfALargeOneHoweverItIsCut) {
  const std::vector<std::size_t> sample = chosen(std::vector<std::size_t>(500, 1));
  EXPECT_EQ(sample.size(), GapCheck::kProbes);
  EXPECT_EQ(chosen({300, 200}), sample);
  EXPECT_GT(*std::ranges::max_element(sample), 500U);
  EXPECT_LT(*std::ranges::min_element(sample), 500U);
}

TEST(GapCheck, GivesTheLargestDifferences) {
  run::Probe probe;
  probe.problem.reference_mm.resize(5);
  probe.problem.weight.resize(5);
  probe.solution.objective = 1.02e-6;
  probe.solution.base.position_mm = {1.0, 2.0, 3.5};
  compensate::AxisSolution second = probe.solution;
  second.objective = 1e-6;
  second.base.position_mm = {1.0, 2.25, 3.5};
  report::SolverCheck check;
  GapCheck::compare(probe, second, check);
  EXPECT_NEAR(check.largest_gap, 0.02, 1e-9);
  EXPECT_EQ(check.largest_difference_mm, 0.25);
  EXPECT_EQ(check.windows, 1U);
  // Nothing moves, so the objectives are rounding errors.
  probe.solution.objective = 3e-22;
  probe.solution.base = second.base;
  second.objective = 1e-22;
  report::SolverCheck still;
  GapCheck::compare(probe, second, still);
  EXPECT_LT(still.largest_gap, 1e-6);
}

}  // namespace
}  // namespace unflex::flow
