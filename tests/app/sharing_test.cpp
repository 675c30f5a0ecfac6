// Other processes at work on the same files, and closed standard streams.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <functional>
#include <thread>

#include "app/program.hpp"
#include "files.hpp"

namespace unflex::app {
namespace {

namespace fs = std::filesystem;
using std::chrono::steady_clock;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::MatchesRegex;
using Words = std::vector<std::string>;

const std::string kPrecious = "precious\n";

class Sharing : public ProgramTest {
 protected:
  Sharing() {
    write_file(path("in.gcode"), small_print());
    write_file(path("out.gcode"), kPrecious);
  }

  // The outcomes of two programs that work on the print at once.
  [[nodiscard]] std::pair<Outcome, Outcome> twice(const Words& words) const {
    Program first(directory(), words);
    Program second(directory(), words);
    Outcome of_first = first.wait();
    return {std::move(of_first), second.wait()};
  }
};

TEST_F(Sharing, CompensatesInPlaceOnce) {
  const std::string whole = run({"compensate", "in.gcode", "-o", "-"}).out;
  for (int i = 0; i < 8; ++i) {
    write_file(path("in.gcode"), small_print());
    const auto [first, second] = twice({"compensate", "in.gcode", "--in-place", "-q"});
    ASSERT_EQ(read_file(path("in.gcode")), whole);
    ASSERT_THAT(names(), ElementsAre("in.gcode", "out.gcode"));
    EXPECT_TRUE(first.exit_code == 0 || second.exit_code == 0);
    for (const Outcome& outcome : {first, second}) {
      EXPECT_THAT(outcome.exit_code, AnyOf(0, 2)) << outcome.err;
      if (outcome.exit_code != 0) {
        EXPECT_THAT(outcome.err, MatchesRegex("in.gcode(:[0-9]+)?: (changed while it was worked "
                                              "on; run|this file was already) [^\n]*\n"));
      }
    }
  }
}

TEST_F(Sharing, WritesOneOutputWholeFromTwo) {
  const std::string whole = run({"compensate", "in.gcode", "-o", "-"}).out;
  for (int i = 0; i < 6; ++i) {
    const auto [first, second] = twice({"compensate", "in.gcode", "-o", "new.gcode", "-q"});
    EXPECT_EQ(first.exit_code, 0) << first.err;
    EXPECT_EQ(second.exit_code, 0) << second.err;
    EXPECT_EQ(read_file(path("new.gcode")), whole);
    ASSERT_THAT(names(), ElementsAre("in.gcode", "new.gcode", "out.gcode"));
  }
}

TEST_F(Sharing, LeavesTheTemporaryFilesOfOthersAlone) {
  const std::jthread other([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      static_cast<void>(TemporaryFile::remove_abandoned(directory()));
    }
  });
  for (int i = 0; i < 3000; ++i) {
    const tl::expected<TemporaryFile, int> file = TemporaryFile::create(directory());
    ASSERT_TRUE(file);
    ASSERT_TRUE(fs::exists(file->path())) << i;
  }
}

TEST_F(Sharing, LeavesFilesAloneThatAreNotItsOwn) {
  write_file(path(".unflex-backup"), kPrecious);
  ASSERT_EQ(run({"compensate", "in.gcode", "-o", "out.gcode"}).exit_code, 0);
  EXPECT_EQ(read_file(path(".unflex-backup")), kPrecious);
}

struct Change {
  std::string name;
  std::function<void(const fs::path&)> make;
  std::string message;
};

void PrintTo(const Change& change, std::ostream* out) { *out << change.name; }

class WhileItIsRead : public Sharing, public ::testing::WithParamInterface<Change> {
 protected:
  // Stops the program as soon as its temporary file shows that it has begun, changes the print, and
  // lets the program continue.
  Outcome run_with_change(const Words& words) const {
    Program program(directory(), words);
    const auto deadline = steady_clock::now() + std::chrono::seconds(10);
    while (names().size() < 3 && steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    program.signal(SIGSTOP);
    EXPECT_EQ(names().size(), 3U) << "too fast to be met half-way";
    GetParam().make(path("in.gcode"));
    program.signal(SIGCONT);
    return program.wait();
  }
};

TEST_P(WhileItIsRead, AChangedPrintIsNotCompensated) {
  for (const bool in_place : {false, true}) {
    write_file(path("in.gcode"), squares(400));
    const Outcome outcome =
        run_with_change(in_place ? Words{"compensate", "in.gcode", "--in-place"}
                                 : Words{"compensate", "in.gcode", "-o", "out.gcode"});
    EXPECT_EQ(outcome.exit_code, 2);
    EXPECT_EQ(outcome.err, GetParam().message);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(read_file(path("out.gcode")), kPrecious);
    // The change by the other process must persist.
    const std::string found = read_file(path("in.gcode"));
    write_file(path("in.gcode"), squares(400));
    GetParam().make(path("in.gcode"));
    EXPECT_EQ(read_file(path("in.gcode")), found);
    fs::remove(path("in.gcode"));
    EXPECT_THAT(names(), ElementsAre("out.gcode"));
  }
}

TEST_P(WhileItIsRead, AChangedPrintIsNotInspected) {
  write_file(path("in.gcode"), squares(60'000));
  const Outcome outcome = run_with_change({"inspect", "in.gcode", "--report", "new.json"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err, GetParam().message);
  EXPECT_EQ(outcome.out, "");
  fs::remove(path("in.gcode"));
  EXPECT_THAT(names(), ElementsAre("out.gcode"));
}

const std::string kChanged = "in.gcode: changed while it was worked on; run unflex again\n";

INSTANTIATE_TEST_SUITE_P(
    By, WhileItIsRead,
    ::testing::Values(
        Change{"Growing",
               [](const fs::path& file) { write_file(file, read_file(file) + "G1 X30 Y30 E1\n"); },
               kChanged},
        Change{"Shrinking", [](const fs::path& file) { fs::resize_file(file, 900); }, kChanged},
        Change{"AnotherInItsPlace",
               [](const fs::path& file) {
                 const fs::path other = file.parent_path() / "other";
                 write_file(other, squares(2));
                 fs::rename(other, file);
               },
               kChanged},
        Change{"Vanishing", [](const fs::path& file) { fs::remove(file); },
               "in.gcode: vanished while it was worked on; run unflex again\n"}),
    [](const auto& change) { return change.param.name; });

TEST_F(Sharing, NeedsNoStandardStreams) {
  const std::string whole = run({"compensate", "in.gcode", "-o", "-"}).out;
  for (int closed = 0; closed < 8; ++closed) {
    write_file(path("out.gcode"), kPrecious);
    const Outcome outcome = run({"compensate", "in.gcode", "-o", "out.gcode"}, "", [closed] {
      for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if ((closed >> fd & 1) != 0) {
          ::close(fd);
        }
      }
    });
    const bool no_stdout = (closed >> STDOUT_FILENO & 1) != 0;
    const bool no_stderr = (closed >> STDERR_FILENO & 1) != 0;
    // The summary cannot be written to a closed stdout; stderr says so unless it is closed too.
    EXPECT_EQ(outcome.exit_code, no_stdout ? 4 : 0) << closed;
    EXPECT_EQ(outcome.err,
              no_stdout && !no_stderr ? "stdout: cannot write: Bad file descriptor\n" : "");
    EXPECT_EQ(read_file(path("out.gcode")), whole);
  }
  const auto closing = [](int fd) { return [fd] { ::close(fd); }; };
  EXPECT_EQ(run({"compensate", "-", "-o", "out.gcode"}, "", closing(STDIN_FILENO)).err,
            "-: cannot read: Bad file descriptor\n");
  EXPECT_EQ(run({"compensate", "in.gcode", "-o", "-"}, "", closing(STDOUT_FILENO)).err,
            "stdout: cannot write: Bad file descriptor\n");
  EXPECT_EQ(read_file(path("in.gcode")), small_print());
}

}  // namespace
}  // namespace unflex::app
