// The writer by itself: which text it chooses for a run, and what it says of the choice.
#include "unflex/run/run_writer.hpp"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "jobs.hpp"
#include "unflex/compensate/run.hpp"
#include "unflex/run/emit_options.hpp"
#include "unflex/run/piece_reader.hpp"
#include "unflex/run/setup.hpp"
#include "unflex/run/verify_rules.hpp"

namespace unflex::run {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;

const std::string kHead = "G28\nG90\nM83\nG1 X50 Y50 Z0.2 F6000\n";
const std::string kCorner = "G1 X80 E1\nG1 Y80 E1\n";

class Writer : public ::testing::Test {
 protected:
  explicit Writer(double max_lines_per_s = 1000.0)
      : settings_(flow::testing::settings()),
        rules_(std::make_shared<RunRules>(
            RunRules{settings_, compensate_setup(settings_), compensate_setup(settings_),
                     emit_options(settings_, "test"), verify_rules(settings_)})),
        writer_(*rules_, "in.gcode", max_lines_per_s, report_) {}

  // The pieces of a text, ready to be written.
  std::vector<std::unique_ptr<RunJob>> jobs_of(const std::string& text) {
    std::istringstream stream(text);
    PieceReader reader(stream, "in.gcode", rules_->emit.interpreter, rules_->emit.printer_limits,
                       rules_->emit.fixed);
    std::vector<std::unique_ptr<RunJob>> jobs;
    for (Piece piece; reader.next(piece).value(); piece = {}) {
      jobs.push_back(std::make_unique<RunJob>());
      jobs.back()->piece = std::move(piece);
      if (jobs.back()->piece.is_run) {
        solve(*jobs.back());
      }
    }
    return jobs;
  }

  std::string written(const RunJob& job) {
    const Result<std::string> text = write(writer_, job);
    EXPECT_TRUE(text.has_value()) << to_string(text.error());
    return text.value_or("");
  }

  // Writes the piece, with all that is to be tried with it.
  Result<std::string> write(RunWriter& writer, const RunJob& job) {
    std::shared_ptr<RunJob> tried;
    for (;;) {
      Result<RunWriter::Written> written = writer.write(job, tried.get());
      if (!written) {
        return tl::unexpected(written.error());
      }
      const Try* const next = std::get_if<Try>(&*written);
      if (next == nullptr) {
        return std::get<std::string>(std::move(*written));
      }
      tries_.push_back(next->remedy);
      tried = once_more(job, *next);
      work_out(*tried, next->remedy);
    }
  }

  machine::Settings settings_;
  std::shared_ptr<const RunRules> rules_;
  report::Report report_;
  RunWriter writer_;
  std::vector<Remedy> tries_;  // that the writer has asked for

 private:
  void solve(RunJob& job) {
    const std::vector<planner::PlannedMove>& moves = job.piece.moves;
    job.nozzle = job.piece.before.empty()
                     ? at_rest(moves.front().segment.start_mm, rules_->verify.nozzle)
                     : at_end_of(job.piece.before.back(), rules_->verify.nozzle);
    job.rules = rules_;
    RunSetup setup = setup_for(rules_->setup, job.piece, job.nozzle, settings_);
    job.setup = std::move(setup.setup);
    job.accel = setup.accel;
    job.first_stage = first_stage(job, rules_->verify.nozzle);
    lay_out(job);
    EXPECT_TRUE(solve_windows(job, 0, job.windows.spans.size(), *compensate::make_banded_engine()));
    make_lines(job);
  }
};

TEST_F(Writer, WritesARunAsCompensatedAndTheRestAsItIs) {
  const auto jobs = jobs_of(kHead + kCorner + "G4 P10\n");
  ASSERT_THAT(jobs, SizeIs(3));
  EXPECT_EQ(written(*jobs[0]), kHead);
  const std::string run = written(*jobs[1]);
  EXPECT_THAT(run, HasSubstr(";unflex run\n"));
  EXPECT_THAT(run, HasSubstr(";unflex end\n"));
  EXPECT_THAT(run, Not(HasSubstr("G1 X80 E1\n")));
  EXPECT_THAT(written(*jobs[2]), HasSubstr("G4 P10\n"));
  static_cast<void>(writer_.finish());
  EXPECT_EQ(report_.runs.compensated, 1U);
  EXPECT_EQ(report_.runs.fallback, 0U);
  EXPECT_NEAR(report_.extruded_path.total_mm, 60.0, 1e-9);
  EXPECT_NEAR(report_.extruded_path.compensated_mm, 60.0, 1e-9);
  // The base's tail comes on top.
  EXPECT_GT(writer_.time_factor(), 1.0);
  EXPECT_LT(writer_.time_factor(), 1.05);
  EXPECT_FALSE(writer_.blocked().has_value());
}

TEST_F(Writer, KeepsARunThatHasNoSolutionAndSaysWhy) {
  const auto jobs = jobs_of(kHead + kCorner + "G4 P3000\n" + "G1 X50 E1\nG1 Y50 E1\n");
  ASSERT_THAT(jobs, SizeIs(4));
  jobs[1]->failure = "no solution";
  EXPECT_EQ(written(*jobs[0]), kHead);
  EXPECT_EQ(written(*jobs[1]), kCorner);
  EXPECT_EQ(written(*jobs[2]), "G4 P3000\n");
  ASSERT_THAT(report_.runs.fallbacks, SizeIs(1));
  EXPECT_EQ(report_.runs.fallbacks[0].reason, "no solution");
  EXPECT_EQ(report_.runs.fallbacks[0].first_line, 5U);
  EXPECT_EQ(report_.runs.fallbacks[0].last_line, 6U);
  EXPECT_EQ(report_.runs.fallback, 1U);
  EXPECT_EQ(writer_.time_factor(), 1.0);
  // The swing of the kept run is over after the pause, and the next run is compensated.
  EXPECT_THAT(written(*jobs[3]), HasSubstr(";unflex run\n")) << flow::testing::complaints(report_);
  EXPECT_EQ(report_.runs.compensated, 1U);
}

TEST_F(Writer, KeepsARunThatCompensationMakesWorse) {
  const auto jobs = jobs_of(kHead + kCorner);
  ASSERT_THAT(jobs, SizeIs(2));
  RunJob& job = *jobs[1];
  for (double& y : job.base.y.position_mm) {
    y += 0.2 * (y > 60.0 && y < 70.0 ? 1.0 : 0.0);
  }
  job.plan = emit::plan_run(job.run(), job.piece.start, rules_->emit);
  static_cast<void>(written(*jobs[0]));
  EXPECT_EQ(written(job), kCorner);
  ASSERT_THAT(report_.runs.fallbacks, SizeIs(1));
  EXPECT_THAT(report_.runs.fallbacks[0].reason, Not(HasSubstr("no solution")));
}

TEST_F(Writer, PlansARunAgainForTheStateItFinds) {
  const auto jobs = jobs_of(kHead + kCorner);
  ASSERT_THAT(jobs, SizeIs(2));
  RunJob& job = *jobs[1];
  static_cast<void>(written(*jobs[0]));
  const std::string as_planned = [&] {
    RunWriter other(*rules_, "in.gcode", 1000.0, report_);
    static_cast<void>(write(other, *jobs[0]));
    return write(other, job).value_or("");
  }();
  job.plan.start.speed_factor = 2.0;
  EXPECT_EQ(written(job), as_planned);
}

class SlowReader : public Writer {
 protected:
  SlowReader() : Writer(5.0) {}
};

TEST_F(SlowReader, GetsTheSlicedLinesWhereCompensatedOnesAreTooMany) {
  const auto jobs = jobs_of(kHead + kCorner);
  static_cast<void>(written(*jobs[0]));
  EXPECT_EQ(written(*jobs[1]), kCorner);
  ASSERT_THAT(report_.runs.fallbacks, SizeIs(1));
  EXPECT_THAT(report_.runs.fallbacks[0].reason, HasSubstr("lines"));
}

// Circles for more than a minute without a stop.
std::string long_run() {
  constexpr double kRadius_mm = 30.0;
  constexpr double kStep_mm = 1.5;
  std::string text = "G1 F2400\n";
  for (int i = 1; i <= 3200; ++i) {
    const double angle = std::numbers::pi - i * kStep_mm / kRadius_mm;
    text += fmt::format("G1 X{:.3f} Y{:.3f} E0.05\n", 80.0 + kRadius_mm * std::cos(angle),
                        50.0 + kRadius_mm * std::sin(angle));
  }
  return text;
}

// If it were kept, all of the run would stand as sliced.
TEST_F(Writer, WritesTheBeginningOfALongRunThoughItIsALittleWorse) {
  const auto jobs = jobs_of(kHead + long_run());
  ASSERT_GE(jobs.size(), 3U);
  RunJob& first = *jobs[1];
  ASSERT_TRUE(first.piece.begins_run() && !first.piece.ends_run());
  constexpr std::size_t kNodes = 60;
  constexpr double kBump_mm = 0.015;
  for (std::size_t k = 0; k < kNodes; ++k) {
    const double up = std::sin(std::numbers::pi * static_cast<double>(k) / kNodes);
    first.base.y.position_mm[first.base.nodes() / 2 + k] += kBump_mm * up * up;
  }
  first.plan = emit::plan_run(first.run(), first.piece.start, rules_->emit);
  static_cast<void>(written(*jobs[0]));
  EXPECT_THAT(written(first), StartsWith(";unflex test"));
  ASSERT_THAT(report_.warnings, SizeIs(1));
  EXPECT_THAT(report_.warnings[0], HasSubstr("in a part of a long run, the nozzle strays more"));
  EXPECT_THAT(written(*jobs[2]), HasSubstr("G1 X"));
  EXPECT_THAT(report_.runs.fallbacks, SizeIs(0));
}

TEST_F(Writer, EndsWithTheLinesOfAPartThatCannotBeWritten) {
  const auto jobs = jobs_of(kHead + long_run());
  ASSERT_GE(jobs.size(), 3U);
  ASSERT_FALSE(jobs[2]->piece.begins_run());
  jobs[2]->failure = "no solution";
  static_cast<void>(written(*jobs[0]));
  EXPECT_THAT(written(*jobs[1]), StartsWith(";unflex test"));
  const Result<std::string> second = write(writer_, *jobs[2]);
  ASSERT_FALSE(second.has_value());
  EXPECT_EQ(second.error().kind, ErrorKind::input);
  EXPECT_EQ(second.error().place.file, "in.gcode");
  EXPECT_EQ(second.error().place.line, jobs[2]->piece.events.front().line.number);
  EXPECT_THAT(second.error().message, HasSubstr("no solution"));
  ASSERT_TRUE(writer_.blocked().has_value());
  EXPECT_EQ(writer_.blocked()->first_line, 6U);
  EXPECT_EQ(writer_.blocked()->last_line, jobs[2]->piece.moves.back().segment.line);
}

TEST_F(Writer, KeepsAllPartsBehindABeginningThatIsKept) {
  const auto jobs = jobs_of(kHead + long_run());
  ASSERT_GE(jobs.size(), 4U);
  jobs[1]->failure = "no solution";
  std::string text;
  for (const auto& job : jobs) {
    text += written(*job);
  }
  EXPECT_EQ(text + writer_.finish(), kHead + long_run());
  EXPECT_EQ(report_.runs.fallback, 1U);
  EXPECT_THAT(report_.runs.fallbacks, SizeIs(jobs.size() - 1));
  EXPECT_EQ(report_.runs.fallbacks[1].reason, "the run's beginning stands as it is");
}

std::vector<Try> all(Tries tries) {
  std::vector<Try> result;
  while (const std::optional<Try> next = tries.next()) {
    result.push_back(*next);
  }
  return result;
}

TEST(Tries, EndWithTheTimingAsSlicedWhereItIsFree) {
  const auto free = std::make_unique<RunJob>();
  RunJob& job = *free;
  job.retimed.emplace();
  std::vector<Try> scaled = all(Tries(job, "too fast", false));
  ASSERT_THAT(scaled, SizeIs(4));
  EXPECT_EQ(scaled[0].remedy, Remedy::scaled);
  EXPECT_LT(scaled[0].accel_share, 1.0);
  EXPECT_LT(scaled[1].accel_share, scaled[0].accel_share);
  EXPECT_EQ(scaled[3].remedy, Remedy::as_sliced);
  // An optimal timing has not been scaled yet, so the first try has all that the motors give.
  job.retimed = NewTiming{{}, {}, dynamics::BaseTrajectory{}};
  scaled = all(Tries(job, "too fast", false));
  ASSERT_THAT(scaled, SizeIs(4));
  EXPECT_EQ(scaled[0].accel_share, 1.0);
}

TEST(Tries, LeaveAReserveToWholeSteps) {
  RunJob job;
  EXPECT_THAT(all(Tries(job, "too fast", false)), SizeIs(0));
  const std::vector<Try> reserves = all(Tries(job, "too fast", true));
  ASSERT_THAT(reserves, SizeIs(3));
  for (const Try& reserve : reserves) {
    EXPECT_EQ(reserve.remedy, Remedy::reserve);
  }
  // There is no base that could do less.
  job.failure = "no solution";
  EXPECT_THAT(all(Tries(job, job.failure, true)), SizeIs(0));
}

TEST(Tries, WorkOnARunOfTheirOwn) {
  RunJob job;
  job.setup.x.limits.max_accel_mm_s2 = 10000.0;
  job.sliced_setup = job.setup;
  job.sliced_setup->x.limits.max_accel_mm_s2 = 4000.0;
  job.stage = Stage::lined;
  const auto slower = once_more(job, {Remedy::scaled, 0.5});
  EXPECT_DOUBLE_EQ(slower->setup.x.limits.max_accel_mm_s2, 5000.0);
  EXPECT_FALSE(slower->has_come_to(Stage::timed));
  const auto sliced = once_more(job, {Remedy::as_sliced});
  EXPECT_DOUBLE_EQ(sliced->setup.x.limits.max_accel_mm_s2, 4000.0);
  EXPECT_DOUBLE_EQ(job.setup.x.limits.max_accel_mm_s2, 10000.0);
}

}  // namespace
}  // namespace unflex::run
