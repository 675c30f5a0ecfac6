#include "worker_pool.hpp"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>

#include "engines.hpp"
#include "wire.hpp"

namespace unflex::flow {
namespace {

using testing::factory;

// What a window of these tests asks of its engine, stored as its first reference position.
enum Task : int { kSolve, kRefuse, kDie, kThrow, kSleep, kAbort };

compensate::AxisWindow window(Task task, double mark = 0.0) {
  compensate::AxisWindow window;
  window.reference_mm = {static_cast<double>(task), mark, 0.0};
  window.weight = {1.0, 1.0, 1.0};
  return window;
}

Result<compensate::AxisSolution> obey(const compensate::AxisWindow& window) {
  switch (static_cast<Task>(window.reference_mm[0])) {
    case kRefuse:
      return fail(ErrorKind::internal, "the window asks for it");
    case kDie:
      raise(SIGKILL);
      break;
    case kThrow:
      throw std::runtime_error("out of luck");
    case kAbort:
      std::abort();
    case kSleep:
      std::this_thread::sleep_for(std::chrono::hours(1));
      break;
    case kSolve:
      // Windows with a mark above one take longer.
      std::this_thread::sleep_for(std::chrono::milliseconds(window.reference_mm[1] > 1.0 ? 60 : 0));
      break;
  }
  compensate::AxisSolution solution = testing::plain_solution(window);
  solution.objective = window.reference_mm[1];
  return solution;
}

WorkerPool pool_of(unsigned workers) {
  Result<WorkerPool> pool = WorkerPool::start(workers, factory(obey));
  EXPECT_TRUE(pool.has_value());
  return std::move(*pool);
}

// Waits until no window is under way.
std::map<std::size_t, Result<compensate::AxisSolution>> take_all(WorkerPool& pool) {
  std::map<std::size_t, Result<compensate::AxisSolution>> taken;
  while (pool.under_way() > 0) {
    if (std::optional<WorkerPool::Done> done = pool.take(10000)) {
      EXPECT_TRUE(taken.emplace(done->ticket, std::move(done->solution)).second) << done->ticket;
    }
  }
  return taken;
}

TEST(WorkerPool, GivesEveryTicketItsOwnSolution) {
  for (const unsigned workers : {1U, 2U, 5U}) {
    WorkerPool pool = pool_of(workers);
    for (std::size_t i = 0; i < 40; ++i) {
      pool.submit(100 + i, window(kSolve, static_cast<double>(i) / 64.0));
    }
    EXPECT_EQ(pool.under_way(), 40U);
    const auto taken = take_all(pool);
    ASSERT_EQ(taken.size(), 40U);
    for (std::size_t i = 0; i < 40; ++i) {
      ASSERT_TRUE(taken.at(100 + i).has_value());
      EXPECT_EQ(taken.at(100 + i)->objective, static_cast<double>(i) / 64.0);
    }
  }
}

TEST(WorkerPool, HandsOutWhatIsReadyFirst) {
  WorkerPool pool = pool_of(2);
  pool.submit(1, window(kSolve, 2.0));
  pool.submit(2, window(kSolve, 0.5));
  std::optional<WorkerPool::Done> first = pool.take(10000);
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->ticket, 2U);
  std::optional<WorkerPool::Done> second = pool.take(10000);
  ASSERT_TRUE(second.has_value());
  EXPECT_EQ(second->ticket, 1U);
}

TEST(WorkerPool, DoesNotWaitWhereNothingIsUnderWay) {
  WorkerPool pool = pool_of(1);
  EXPECT_FALSE(pool.take(60000).has_value());
}

TEST(WorkerPool, DoesNotWaitLongerThanAllowed) {
  WorkerPool pool = pool_of(1);
  pool.submit(1, window(kSleep));
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_FALSE(pool.take(20).has_value());
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
  EXPECT_EQ(pool.under_way(), 1U);
}

TEST(WorkerPool, EndsAtOnceWithWorkersStillBusy) {
  const auto begin = std::chrono::steady_clock::now();
  {
    WorkerPool pool = pool_of(3);
    for (std::size_t i = 0; i < 6; ++i) {
      pool.submit(i, window(kSleep));
    }
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
  EXPECT_EQ(waitpid(-1, nullptr, WNOHANG), -1) << "a child is left";
}

TEST(WorkerPool, FailsWhatIsLeftWhereNoProcessCanBeStarted) {
  WorkerPool pool = pool_of(1);
  rlimit descriptors{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &descriptors), 0);
  // poll() needs as many descriptors as it waits for.
  const rlimit none{1, descriptors.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  pool.submit(7, window(kDie));
  pool.submit(8, window(kSolve));
  const auto taken = take_all(pool);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &descriptors), 0);
  ASSERT_EQ(taken.size(), 2U);
  for (const auto& [ticket, solution] : taken) {
    ASSERT_FALSE(solution.has_value()) << ticket;
    EXPECT_EQ(solution.error().message, "no solver process is left");
  }
}

TEST(WorkerPool, PassesAnErrorOfTheEngineOn) {
  WorkerPool pool = pool_of(1);
  pool.submit(7, window(kRefuse));
  pool.submit(8, window(kSolve));
  const auto taken = take_all(pool);
  ASSERT_FALSE(taken.at(7).has_value());
  EXPECT_EQ(taken.at(7).error().message, "the window asks for it");
  EXPECT_TRUE(taken.at(8).has_value());
}

TEST(Answer, IsWhatTheEngineThrew) {
  const Result<compensate::AxisSolution> there =
      unpack_solution(answer(testing::TestEngine(obey), pack(window(kThrow))));
  ASSERT_FALSE(there.has_value());
  EXPECT_EQ(there.error().kind, ErrorKind::internal);
  EXPECT_EQ(there.error().message, "out of luck");
}

TEST(WorkerPool, PassesAnExceptionOfTheEngineOn) {
  WorkerPool pool = pool_of(1);
  pool.submit(7, window(kThrow));
  pool.submit(8, window(kSolve));
  const auto taken = take_all(pool);
  ASSERT_FALSE(taken.at(7).has_value());
  EXPECT_EQ(taken.at(7).error().message, "out of luck");
  EXPECT_TRUE(taken.at(8).has_value());
}

class Deaths : public ::testing::TestWithParam<Task> {};

TEST_P(Deaths, CostNoMoreThanTheWindowThatBroughtThem) {
  for (const unsigned workers : {1U, 3U}) {
    WorkerPool pool = pool_of(workers);
    for (std::size_t i = 0; i < 24; ++i) {
      pool.submit(i, window(i % 6 == 3 ? GetParam() : kSolve, static_cast<double>(i) / 64.0));
    }
    const auto taken = take_all(pool);
    ASSERT_EQ(taken.size(), 24U);
    for (const auto& [ticket, solution] : taken) {
      if (ticket % 6 == 3) {
        ASSERT_FALSE(solution.has_value()) << ticket;
        EXPECT_FALSE(solution.error().message.empty());
      } else {
        ASSERT_TRUE(solution.has_value()) << ticket << ": " << solution.error().message;
        EXPECT_EQ(solution->objective, static_cast<double>(ticket) / 64.0);
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(OfWorkers, Deaths, ::testing::Values(kDie, kAbort),
                         [](const auto& tested) {
                           return std::string(tested.param == kDie ? "Killed" : "Aborting");
                         });

TEST(WorkerPool, SurvivesTheDeathOfAnIdleWorker) {
  WorkerPool pool = pool_of(1);
  // The only child of this process is the worker.
  std::ifstream children(fmt::format("/proc/self/task/{}/children", getpid()));
  pid_t worker = -1;
  if (!(children >> worker)) {
    GTEST_SKIP() << "the kernel does not list children";
  }
  ASSERT_EQ(kill(worker, SIGKILL), 0);
  pool.submit(1, window(kSolve, 0.25));
  pool.submit(2, window(kSolve, 0.5));
  const auto taken = take_all(pool);
  ASSERT_EQ(taken.size(), 2U);
  for (const std::size_t ticket : {1U, 2U}) {
    ASSERT_TRUE(taken.at(ticket).has_value()) << taken.at(ticket).error().message;
    EXPECT_EQ(taken.at(ticket)->objective, 0.25 * static_cast<double>(ticket));
  }
}

TEST(WorkerPool, HasAWindowUnderWayUntilTheDeathsOfItAreTold) {
  Result<WorkerPool> pool =
      WorkerPool::start(1, []() -> std::unique_ptr<compensate::Engine> { throw std::bad_alloc(); });
  ASSERT_TRUE(pool.has_value());
  // Larger than a socket's buffer, so both deaths are noticed during sending.
  compensate::AxisWindow large = window(kSolve);
  large.reference_mm.resize(1'000'000);
  pool->submit(7, large);
  EXPECT_EQ(pool->under_way(), 1U);
  const auto taken = take_all(*pool);
  ASSERT_EQ(taken.size(), 1U);
  ASSERT_FALSE(taken.at(7).has_value());
  EXPECT_EQ(taken.at(7).error().message, "two solver processes died of it");
}

// The system may kill a worker when memory runs out. That is no fault of the window.
TEST(WorkerPool, SolvesAWindowAgainWhoseWorkerWasKilled) {
  WorkerPool pool = pool_of(1);
  std::ifstream children(fmt::format("/proc/self/task/{}/children", getpid()));
  pid_t worker = -1;
  if (!(children >> worker)) {
    GTEST_SKIP() << "the kernel does not list children";
  }
  pool.submit(1, window(kSolve, 2.0));
  ASSERT_EQ(kill(worker, SIGKILL), 0);
  const auto taken = take_all(pool);
  ASSERT_EQ(taken.size(), 1U);
  ASSERT_TRUE(taken.at(1).has_value()) << taken.at(1).error().message;
  EXPECT_EQ(taken.at(1)->objective, 2.0);
}

TEST(WorkerPool, GoesOnAfterBeingMoved) {
  WorkerPool first = pool_of(2);
  first.submit(5, window(kSolve, 0.125));
  WorkerPool second = std::move(first);
  second.submit(6, window(kSolve, 0.25));
  EXPECT_EQ(take_all(second).size(), 2U);
}

}  // namespace
}  // namespace unflex::flow
