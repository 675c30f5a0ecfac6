// Text passes through the program as it arrives.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <iterator>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "app/program.hpp"
#include "paths.hpp"

namespace unflex::app {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Runs the program with pipes at both ends, which stay open.
class Filter {
 public:
  explicit Filter(const std::filesystem::path& errors) {
    std::array<int, 2> in{};
    std::array<int, 2> out{};
    EXPECT_EQ(::pipe(in.data()), 0);
    EXPECT_EQ(::pipe(out.data()), 0);
    pid_ = ::fork();
    if (pid_ == 0) {
      ::dup2(in[0], STDIN_FILENO);
      ::dup2(out[1], STDOUT_FILENO);
      for (const int fd : {in[0], in[1], out[0], out[1]}) {
        ::close(fd);
      }
      static_cast<void>(std::freopen(errors.c_str(), "w", stderr));
      ::execl(test_paths::kProgram, "unflex", "compensate", "-", "-o", "-", "--set",
              "dynamics.x.freq_hz=45", "--set", "dynamics.y.freq_hz=45", nullptr);
      ::_exit(127);
    }
    ::close(in[0]);
    ::close(out[1]);
    in_ = in[1];
    out_ = out[0];
  }
  ~Filter() {
    close_input();
    close_output();
  }
  Filter(const Filter&) = delete;
  Filter& operator=(const Filter&) = delete;

  void write(std::string_view text) const {
    ASSERT_EQ(::write(in_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  void close_input() {
    if (in_ >= 0) {
      ::close(in_);
      in_ = -1;
    }
  }

  void close_output() {
    if (out_ >= 0) {
      ::close(out_);
      out_ = -1;
    }
  }
  // The exit code, or −1 if the program has not ended within ten seconds and is killed.
  [[nodiscard]] int wait() const {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    int status = 0;
    while (::waitpid(pid_, &status, WNOHANG) == 0) {
      if (std::chrono::steady_clock::now() > deadline) {
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, &status, 0);
        return -1;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  // Reads until `what` has come, for half a minute at most. Returns everything that has come.
  const std::string& read_until(std::string_view what) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (text_.find(what) == std::string::npos && std::chrono::steady_clock::now() < deadline &&
           read_some()) {
    }
    return text_;
  }
  // Reads to the end and returns the exit code.
  int finish() {
    while (read_some()) {
    }
    int status = 0;
    ::waitpid(pid_, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  bool read_some() {
    pollfd ready{out_, POLLIN, 0};
    if (::poll(&ready, 1, 1000) == 0) {
      return true;
    }
    std::array<char, 4096> block{};
    const ssize_t count = ::read(out_, block.data(), block.size());
    if (count > 0) {
      text_.append(block.data(), static_cast<std::size_t>(count));
    }
    return count > 0;
  }

  pid_t pid_ = -1;
  int in_ = -1;
  int out_ = -1;
  std::string text_;
};

constexpr std::string_view kFirstRun =
    "; sliced\nG28\nG90\nM83\nM73 P0 R10\nG1 Z0.4 F6000\nG1 X20 Y20 F6000\nG4 P500\nG1 X40 Y20 "
    "E0.8 F3000\n"
    "G1 X40 Y40 E0.8\nG1 E-1\n";
constexpr std::string_view kSecondRun = "G1 X20 Y40 F6000\nG1 E1\nG1 X20 Y20 E0.8 F3000\nM84\n";

TEST_F(ProgramTest, PassesARunOnAsSoonAsItHasEnded) {
  Filter filter(path("err"));
  filter.write(kFirstRun);
  EXPECT_THAT(filter.read_until(";unflex end"), HasSubstr(";unflex end"));
  EXPECT_THAT(filter.text(), Not(HasSubstr("M84")));
  filter.write(kSecondRun);
  filter.close_input();
  EXPECT_EQ(filter.finish(), 0);
  EXPECT_THAT(filter.text(), HasSubstr("\nM84\n"));
  // A file gets equal bytes; the durations in M73 are too short to change.
  write_file(path("in.gcode"), std::string(kFirstRun) + std::string(kSecondRun));
  EXPECT_EQ(run({"compensate", "in.gcode", "-o", "out.gcode", "--set", "dynamics.freq_error=0.1"})
                .exit_code,
            0);
  EXPECT_EQ(filter.text(), read_file(path("out.gcode")));
}

TEST_F(ProgramTest, EndsWhenItsInputEndsBeforeAnything) {
  Filter filter(path("err"));
  filter.close_input();
  EXPECT_EQ(filter.finish(), 2);
  EXPECT_EQ(filter.text(), "");
}

// The input stays open, but nothing more comes.
TEST_F(ProgramTest, EndsWhenNobodyReadsItThoughItsInputGoesOn) {
  Filter filter(path("err"));
  filter.close_output();
  filter.write(kFirstRun);
  EXPECT_EQ(filter.wait(), 4);
  EXPECT_EQ(read_file(path("err")), "stdout: cannot write: Broken pipe\n");
}

// A pipe with non-blocking ends, as event loops make them.
class LoosePipe {
 public:
  LoosePipe() {
    EXPECT_EQ(::pipe2(ends_.data(), O_NONBLOCK | O_CLOEXEC), 0);
    // One page, the smallest size.
    EXPECT_GT(::fcntl(ends_[1], F_SETPIPE_SZ, 4096), 0);
  }
  ~LoosePipe() {
    close_writer();
    ::close(ends_[0]);
  }
  LoosePipe(const LoosePipe&) = delete;
  LoosePipe& operator=(const LoosePipe&) = delete;

  [[nodiscard]] int reader() const { return ends_[0]; }
  [[nodiscard]] int writer() const { return ends_[1]; }
  void close_writer() { ::close(std::exchange(ends_[1], -1)); }

  // Reads a few bytes at a time, slowly, until the other end is closed.
  [[nodiscard]] std::string read_slowly() const {
    std::string text;
    std::array<char, 4096> block{};
    for (;;) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      const ssize_t count = ::read(reader(), block.data(), block.size());
      if (count == 0 || (count < 0 && errno != EAGAIN)) {
        return text;
      }
      text.append(block.data(), static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    }
  }

 private:
  std::array<int, 2> ends_{};
};

TEST_F(ProgramTest, WaitsForInputThatDoesNotBlock) {
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"inspect", "-"},
        std::vector<std::string>{"compensate", "-", "-o", "out.gcode"}}) {
    LoosePipe pipe;
    Program program(directory(), words, "", [&] { ::dup2(pipe.reader(), STDIN_FILENO); });
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    const std::string text = small_print();
    ASSERT_LT(text.size(), 4096U);
    ASSERT_EQ(::write(pipe.writer(), text.data(), text.size()), std::ssize(text));
    pipe.close_writer();
    const Outcome outcome = program.wait();
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  }
}

TEST_F(ProgramTest, WaitsForWhoeverReadsAStreamThatDoesNotBlock) {
  write_file(path("in.gcode"), small_print());
  for (const std::string report : {"r.json", "r.html"}) {
    LoosePipe pipe;
    std::filesystem::create_symlink("/dev/stdout", path(report));
    Program program(directory(), {"compensate", "in.gcode", "-o", "out.gcode", "--report", report},
                    "", [&] { ::dup2(pipe.writer(), STDOUT_FILENO); });
    pipe.close_writer();
    const std::string text = pipe.read_slowly();
    const Outcome outcome = program.wait();
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_GT(text.size(), 4096U);
  }
}

}  // namespace
}  // namespace unflex::app
