// A program that a signal asks to end leaves nothing behind.

#include <fcntl.h>
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <thread>

#include "app/program.hpp"
#include "paths.hpp"

namespace unflex::app {
namespace {

using ::testing::ElementsAre;

// Long enough that it cannot be done before the signal comes.
std::string long_print() { return squares(3000); }

// Waits until the work has begun, which its temporary file shows.
bool wait_for_names(const std::filesystem::path& directory, std::ptrdiff_t count) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (std::chrono::steady_clock::now() < deadline) {
    const auto entries = std::filesystem::directory_iterator(directory);
    if (std::distance(begin(entries), end(entries)) >= count) {
      return true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

class EndingSignal : public ProgramTest, public ::testing::WithParamInterface<int> {};

TEST_P(EndingSignal, RemovesTheTemporaryFileAndKeepsTheTarget) {
  write_file(path("in.gcode"), long_print());
  write_file(path("out.gcode"), "precious\n");
  Program program(directory(), {"compensate", "in.gcode", "-o", "out.gcode"});
  ASSERT_TRUE(wait_for_names(directory(), 3));
  program.signal(GetParam());
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 128 + GetParam());
  EXPECT_EQ(outcome.err, "unflex: interrupted, no file was written\n");
  EXPECT_EQ(outcome.out, "");
  EXPECT_EQ(read_file(path("out.gcode")), "precious\n");
  EXPECT_THAT(names(), ElementsAre("in.gcode", "out.gcode"));
}

INSTANTIATE_TEST_SUITE_P(OfEveryKind, EndingSignal, ::testing::Values(SIGINT, SIGTERM, SIGHUP));

// Makes stdout a full pipe that nobody reads.
void stop_stdout() {
  std::array<int, 2> pipe{};
  if (::pipe(pipe.data()) == 0) {
    ::fcntl(pipe[1], F_SETFL, O_NONBLOCK);
    while (::write(pipe[1], "x", 1) == 1) {
    }
    ::fcntl(pipe[1], F_SETFL, 0);
    ::dup2(pipe[1], STDOUT_FILENO);
  }
}

// Only the summary is missing when the signal comes.
TEST_F(ProgramTest, DoesNotSayThatNothingWasWrittenOnceItWas) {
  write_file(path("in.gcode"), small_print());
  Program program(directory(), {"compensate", "in.gcode", "--in-place"}, "", stop_stdout);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (read_file(path("in.gcode")) == small_print() &&
         std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  program.signal(SIGINT);
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err, "");
  EXPECT_THAT(read_file(path("in.gcode")), ::testing::HasSubstr(";unflex"));
}

TEST_F(ProgramTest, DoesNotSayThatNoReportWasWrittenOnceItWas) {
  write_file(path("in.gcode"), small_print());
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"inspect", "in.gcode", "--report", "new.json"},
        std::vector<std::string>{"printer", "init", "--from", "p.toml", "-o", "new.json"}}) {
    std::filesystem::remove(path("new.json"));
    write_file(path("p.toml"),
               "[limits]\nmax_accel_mm_s2 = 3000\n[dynamics]\nx.freq_hz = 45\ny.freq_hz = 45\n");
    Program program(directory(), words, "", stop_stdout);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!std::filesystem::exists(path("new.json")) &&
           std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    program.signal(SIGINT);
    const Outcome outcome = program.wait();
    EXPECT_EQ(outcome.exit_code, 0) << words.front();
    EXPECT_EQ(outcome.err, "") << words.front();
  }
}

// stdout is non-blocking and nobody reads it.
TEST_F(ProgramTest, EndsWhileItWaitsForAStreamThatDoesNotBlock) {
  write_file(path("in.gcode"), small_print());
  Program program(directory(), {"compensate", "in.gcode", "-o", "out.gcode", "--report", "-"}, "",
                  [] {
                    stop_stdout();
                    ::fcntl(STDOUT_FILENO, F_SETFL, O_NONBLOCK);
                  });
  ASSERT_TRUE(wait_for_names(directory(), 2));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  program.signal(SIGINT);
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 128 + SIGINT);
  EXPECT_EQ(outcome.err, "unflex: interrupted, no file was written\n");
  EXPECT_THAT(names(), ElementsAre("in.gcode"));
}

TEST_F(ProgramTest, EndsSoonEvenWhereARunTakesLong) {
  // With Marlin's whole steps a run of a minute takes many seconds to compensate.
  std::string text = "G28\nG90\nM83\nG1 X20 Y20 F6000\n";
  for (int i = 0; i < 4000; ++i) {
    text += fmt::format("G1 X{} Y{} E0.05\n", i % 2 == 0 ? 40 : 20, 20.0 + 0.01 * i);
  }
  write_file(path("in.gcode"), text);
  Program program(directory(), {"compensate", "in.gcode", "-o", "out.gcode", "-j", "1", "--set",
                                "printer.firmware=marlin"});
  ASSERT_TRUE(wait_for_names(directory(), 2));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const auto begin = std::chrono::steady_clock::now();
  program.signal(SIGINT);
  const Outcome outcome = program.wait();
  EXPECT_EQ(outcome.exit_code, 128 + SIGINT);
  EXPECT_EQ(outcome.err, "unflex: interrupted, no file was written\n");
  EXPECT_THAT(names(), ElementsAre("in.gcode"));
  // Half a second is expected; the rest is for a busy machine. The work itself takes far longer.
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

TEST_F(ProgramTest, RemovesWhatAKilledRunHasLeft) {
  write_file(path("in.gcode"), long_print());
  Program program(directory(), {"compensate", "in.gcode", "-o", "out.gcode"}, "", leave_uncounted);
  ASSERT_TRUE(wait_for_names(directory(), 2));
  program.signal(SIGKILL);
  EXPECT_EQ(program.wait().exit_code, 128 + SIGKILL);
  EXPECT_EQ(names().size(), 2U);
  write_file(path("small.gcode"), small_print());
  EXPECT_EQ(run({"compensate", "small.gcode", "-o", "out.gcode"}).exit_code, 0);
  EXPECT_THAT(names(), ElementsAre("in.gcode", "out.gcode", "small.gcode"));
}

TEST_F(ProgramTest, EndsWithoutASignalWhenNobodyReadsItsOutput) {
  write_file(path("in.gcode"), small_print());
  int ends[2] = {-1, -1};
  ASSERT_EQ(::pipe(ends), 0);
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(ends[0]);
    ::dup2(ends[1], STDOUT_FILENO);
    ::close(ends[1]);
    const int null = ::open(path("err").c_str(), O_WRONLY | O_CREAT, 0600);
    ::dup2(null, STDERR_FILENO);
    ::execl(test_paths::kProgram, "unflex", "compensate", path("in.gcode").c_str(), "-o", "-",
            "--set", "dynamics.x.freq_hz=45", "--set", "dynamics.y.freq_hz=45", nullptr);
    ::_exit(127);
  }
  ::close(ends[0]);
  ::close(ends[1]);
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 4);
  EXPECT_EQ(read_file(path("err")), "stdout: cannot write: Broken pipe\n");
}

}  // namespace
}  // namespace unflex::app
