// Failures around the program: the input stays unchanged, the output is complete or absent, and one
// line says why.

#include <fcntl.h>
#include <fmt/core.h>
#include <gmock/gmock.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <random>
#include <thread>

#include "app/program.hpp"
#include "container/packed.hpp"
#include "files.hpp"
#include "paths.hpp"

namespace unflex::app {
namespace {

namespace fs = std::filesystem;
using std::chrono::microseconds;
using std::chrono::steady_clock;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::StartsWith;
using Words = std::vector<std::string>;

constexpr uid_t kNobody = 65534;

bool is_temporary(const std::string& name) {
  return name.starts_with(".unflex-") && name.ends_with(".tmp");
}

std::function<void()> limited(int resource, rlim_t most) {
  return [resource, most] {
    leave_uncounted();
    const rlimit limit{most, most};
    ::setrlimit(static_cast<__rlimit_resource>(resource), &limit);
  };
}

// Sets the environment for these faults, see fault_shim.cpp.
std::function<void()> faulty(const std::vector<std::pair<std::string, std::string>>& faults) {
  return [faults] {
    ::setenv("LD_PRELOAD", test_paths::kFaultShim, 1);
    ::setenv("ASAN_OPTIONS", "verify_asan_link_order=0", 1);
    for (const auto& [name, value] : faults) {
      ::setenv(name.c_str(), value.c_str(), 1);
    }
  };
}

class Faults : public ProgramTest {
 protected:
  Faults() {
    write_file(path("in.gcode"), small_print());
    write_file(path("out.gcode"), "precious\n");
  }

  // The output of the small print when nothing fails.
  [[nodiscard]] std::string whole() const { return run({"compensate", "in.gcode", "-o", "-"}).out; }

  // The program said one line, gave this exit code, and left all files unchanged.
  void expect_refusal(const Outcome& outcome, int exit_code, const std::string& message) const {
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_THAT(outcome.err, StartsWith(message));
    EXPECT_EQ(std::ranges::count(outcome.err, '\n'), 1) << outcome.err;
    expect_untouched();
  }
  void expect_untouched() const {
    EXPECT_EQ(read_file(path("in.gcode")), small_print());
    EXPECT_EQ(read_file(path("out.gcode")), "precious\n");
    EXPECT_THAT(names(), ElementsAre("in.gcode", "out.gcode"));
  }
};

const std::string kNoRoom =
    "cannot write the output; make room there, or raise the limit on the size of files (ulimit -f)";
const Words kToFile = {"compensate", "in.gcode", "-o", "out.gcode"};

Words operator+(Words words, const Words& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

// A limit on file size stands for a disk that is full after so many bytes.
TEST_F(Faults, OfAFullDiskLeaveTheOldOutput) {
  const std::string result = whole();
  for (const double share : {0.1, 0.5, 0.9, 0.999}) {
    const auto room = static_cast<rlim_t>(share * static_cast<double>(result.size()));
    expect_refusal(run(kToFile, "", limited(RLIMIT_FSIZE, room)), 4, "out.gcode: " + kNoRoom);
    expect_refusal(run({"compensate", "in.gcode", "--in-place"}, "", limited(RLIMIT_FSIZE, room)),
                   4, "in.gcode: " + kNoRoom);
  }
}

TEST_F(Faults, OfPackingLeaveTheOldOutput) {
  const std::string result = whole();
  for (const std::string name : {"new.gcode.gz", "new.bgcode"}) {
    // Neither kind of fault hits only the packing: the shim does not count calls, and the packed
    // file is smaller than the text, so no limit on size stops it. So let the sync fail.
    expect_refusal(
        run({"compensate", "in.gcode", "-o", name}, "", faulty({{"FAULT_FAIL", "fsync"}})), 4,
        name + ": cannot write: Input/output error\n");
  }
}

TEST_F(Faults, OfAReportWithoutRoomLeaveTheOldOutput) {
  // The report is longer than the output.
  const rlim_t room = whole().size() + 1000;
  expect_refusal(run(kToFile + Words{"--report", "r.html"}, "", limited(RLIMIT_FSIZE, room)), 4,
                 "r.html: cannot write: File too large; raise the limit");
  expect_refusal(run({"inspect", "in.gcode", "--report", "r.json"}, "", limited(RLIMIT_FSIZE, 100)),
                 4, "r.json: cannot write: File too large; raise the limit");
}

TEST_F(Faults, OfStreamsThatAreFullAreTold) {
  for (const Words& words : {Words{"compensate", "in.gcode", "-o", "-"},
                             Words{"inspect", "in.gcode", "--report", "-"}}) {
    expect_refusal(run(words, "", fill_stdout), 4, "stdout: cannot write: No space left on device");
  }
}

TEST_F(Faults, OfAReportToAStreamLeaveTheOldOutput) {
  for (const Words& words : {kToFile, Words{"compensate", "--in-place", "in.gcode"}}) {
    expect_refusal(run(words + Words{"--report", "-"}, "", fill_stdout), 4,
                   "stdout: cannot write: No space left on device");
  }
}

TEST_F(Faults, OfKeepingAStreamAreTold) {
  expect_refusal(run({"inspect", "-"}, squares(20), limited(RLIMIT_FSIZE, 1000)), 4,
                 "-: cannot be kept in /tmp: File too large; raise the limit on the size of files "
                 "(ulimit -f)\n");
}

TEST_F(Faults, OfTheLogAreToldAndDoNotUndoTheWork) {
  const std::string result = whole();
  const Outcome outcome = run(kToFile + Words{"--log", "/dev/full"});
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_EQ(outcome.err,
            "/dev/full: cannot write the log: No space left on device; make room there\n");
  EXPECT_EQ(read_file(path("out.gcode")), result);
}

TEST_F(Faults, OfTheSummaryLeaveAnOutputThatIsWhole) {
  const std::string result = whole();
  const Outcome outcome = run(kToFile, "", fill_stdout);
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_EQ(outcome.err, "stdout: cannot write: No space left on device; make room there\n");
  EXPECT_EQ(read_file(path("out.gcode")), result);
}

// Makes stdout a pipe that nobody reads any more.
void break_stdout() {
  std::array<int, 2> pipe{};
  if (::pipe(pipe.data()) == 0) {
    ::dup2(pipe[1], STDOUT_FILENO);
    ::close(pipe[0]);
    ::close(pipe[1]);
  }
}

// Makes stdout a full pipe that nobody reads.
void stop_stdout() {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_NONBLOCK) == 0) {
    while (::write(pipe[1], "x", 1) == 1) {
    }
    ::fcntl(pipe[1], F_SETFL, 0);
    ::dup2(pipe[1], STDOUT_FILENO);
  }
}

TEST_F(Faults, OfTheSummaryAreToldAsTheyAreWhenASignalCameAfterTheOutput) {
  const std::string result = whole();
  const auto interrupt = faulty({{"FAULT_SIGNAL", "fsync-folder"}});
  const Outcome outcome = run(kToFile + Words{"--report", "r.html"}, "", [&] {
    break_stdout();
    interrupt();
  });
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_EQ(outcome.err, "stdout: cannot write: Broken pipe\n");
  EXPECT_EQ(read_file(path("out.gcode")), result);
  EXPECT_TRUE(read_file(path("r.html")).ends_with("</html>\n"));
}

TEST_F(Faults, OfASummaryThatNobodyTakesDoNotHideWhatWasWritten) {
  write_file(path("p.cfg"),
             "[printer]\nkinematics: cartesian\nmax_velocity: 300\nmax_accel: 3000\n");
  const auto interrupt = faulty({{"FAULT_SIGNAL", "fsync-folder"}});
  for (const Words& words : {Words{"printer", "init", "--from", "p.cfg", "-o", "new.json"},
                             Words{"inspect", "in.gcode", "--report", "new.json"},
                             Words{"identify", "--axis", "x", "--wave-spacing-mm", "2",
                                   "--speed-mm-s", "100", "--report", "new.json"}}) {
    fs::remove(path("new.json"));
    const Outcome outcome = run(words, "", [&] {
      stop_stdout();
      interrupt();
    });
    EXPECT_EQ(outcome.exit_code, 128 + SIGINT) << words.front();
    EXPECT_THAT(outcome.err,
                ::testing::EndsWith("unflex: interrupted; what was written before is whole\n"));
    EXPECT_NE(read_file(path("new.json")), "") << words.front();
  }
}

TEST_F(Faults, OfABatchFailItsPrintsAndLeaveNothingHalf) {
  fs::create_directory(path("in"));
  write_file(path("in/a.g"), small_print());
  write_file(path("in/b.g"), small_print() + small_print() + small_print());
  const Words batch = {"batch", "in", "-o", "out", "-q", "-j", "1"};
  // There is room for the shorter print only.
  const Outcome outcome = run(batch, "", limited(RLIMIT_FSIZE, 2 * whole().size()));
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_EQ(outcome.err, "out/b.g: " + kNoRoom + "\n");
  EXPECT_EQ(read_file(path("out/a.g")), whole());
  EXPECT_FALSE(fs::exists(path("out/b.g")));
  fs::remove_all(path("out"));
  const Outcome forgetful =
      run(batch + Words{"--summary", "s.json"}, "", faulty({{"FAULT_FAIL", "rename"}}));
  EXPECT_EQ(forgetful.exit_code, 4);
  EXPECT_THAT(names(), ElementsAre("in", "in.gcode", "out", "out.gcode"));
  for (const auto& entry : fs::directory_iterator(path("out"))) {
    ADD_FAILURE() << entry.path();
  }
  const Outcome killed = run(batch, "", faulty({{"FAULT_KILL", "rename"}}));
  EXPECT_EQ(killed.exit_code, 4);
  EXPECT_EQ(killed.err,
            "in/b.g: the process died of signal 9 (Killed)\n"
            "in/a.g: the process died of signal 9 (Killed)\n");
  fs::remove_all(path("out"));
  fs::create_directories(path("out/.unflex-batch.json"));
  EXPECT_EQ(run(batch).err, "out/.unflex-batch.json: is a directory; name a file in it\n");
}

// Runs as a user whom permissions stop.
class AsNobody : public Faults {
 protected:
  AsNobody() {
    if (::geteuid() == 0) {
      for (const char* const name : {"", "in.gcode", "out.gcode"}) {
        EXPECT_EQ(::chown(path(name).c_str(), kNobody, kNobody), 0);
      }
      fs::permissions(directory(), fs::perms::all);
    }
  }
  ~AsNobody() override { fs::permissions(directory(), fs::perms::owner_all); }

  [[nodiscard]] Outcome run_there(const Words& arguments, const std::string& input = "") const {
    return run(arguments, input, [] {
      if (::geteuid() == 0 && (::setgid(kNobody) != 0 || ::setuid(kNobody) != 0)) {
        ::_exit(126);
      }
    });
  }
};

TEST_F(AsNobody, IsToldWhatCannotBeWritten) {
  if (run_there({"--version"}).exit_code != 0) {
    GTEST_SKIP() << "the program cannot be run as another user";
  }
  fs::permissions(path("out.gcode"), fs::perms::owner_read);
  expect_refusal(run_there(kToFile), 1,
                 "out.gcode: cannot write: Permission denied; choose another place");
  fs::permissions(path("in.gcode"), fs::perms::owner_read);
  expect_refusal(run_there({"compensate", "in.gcode", "--in-place"}), 1,
                 "in.gcode: cannot write: Permission denied; choose another place");
  fs::permissions(directory(), fs::perms::owner_read | fs::perms::owner_exec);
  const std::string folder = "cannot write to the directory .: Permission denied; choose another";
  expect_refusal(run_there({"compensate", "in.gcode", "-o", "new.gcode"}), 1,
                 "new.gcode: " + folder);
  expect_refusal(run_there({"compensate", "in.gcode", "-o", "-", "--report", "r.json"}), 1,
                 "r.json: " + folder);
  expect_refusal(run_there(Words{"compensate", "in.gcode", "-o", "-", "--log", "log"}), 1,
                 "log: cannot write the log: Permission denied; choose another place");
  expect_refusal(run_there({"batch", ".", "-o", "new"}), 1, "new: cannot make the folder: Perm");
}

TEST_F(AsNobody, IsToldWhatCannotBeRead) {
  if (run_there({"--version"}).exit_code != 0) {
    GTEST_SKIP() << "the program cannot be run as another user";
  }
  fs::create_directories(path("prints/shut"));
  fs::permissions(path("prints/shut"), fs::perms::none);
  EXPECT_THAT(run_there({"batch", "prints", "-o", "made"}).err,
              HasSubstr("prints/shut: cannot read the folder: Permission denied\n"));
  fs::remove_all(path("prints"));
  fs::remove_all(path("made"));
  fs::permissions(path("in.gcode"), fs::perms::none);
  const Outcome outcome = run_there(kToFile);
  fs::permissions(path("in.gcode"), fs::perms::owner_read);
  expect_refusal(outcome, 2, "in.gcode: cannot read: Permission denied");
}

// A member of the group that shares a print replaces the print of another member.
TEST_F(AsNobody, LeavesThePrintToItsGroup) {
  constexpr uid_t kOther = 65001;
  constexpr gid_t kShared = 65002;
  const std::string print = path("in.gcode").string();
  if (::chown(print.c_str(), kOther, kShared) != 0 || ::chmod(print.c_str(), 0660) != 0) {
    GTEST_SKIP() << "files cannot be given to other users";
  }
  const Outcome outcome = run({"compensate", "in.gcode", "--in-place", "-q"}, "", [] {
    const gid_t shared = kShared;
    if (::setgroups(1, &shared) != 0 || ::setgid(kNobody) != 0 || ::setuid(kNobody) != 0) {
      ::_exit(126);
    }
  });
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  struct stat status {};
  ASSERT_EQ(::stat(print.c_str(), &status), 0);
  EXPECT_EQ(status.st_uid, kNobody);
  EXPECT_EQ(status.st_gid, kShared);
  EXPECT_EQ(status.st_mode & 07777U, 0660U);
}

TEST_F(Faults, OfWhatABatchRemembersDoNotStopIt) {
  fs::create_directory(path("in"));
  for (const char* const name : {"a.g", "b.g", "c.g", "d.g", "e.g", "f.g"}) {
    write_file(path("in") / name, "G28\nG1 X10 Y10 F600\n");
  }
  // There is room for each print, but for only some entries in the manifest.
  const Outcome outcome =
      run({"batch", "in", "-o", "out", "-j", "1"}, "", limited(RLIMIT_FSIZE, 2500));
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_THAT(outcome.err, HasSubstr("out/.unflex-batch.json: cannot write: File too large"));
  EXPECT_THAT(outcome.err, HasSubstr("[6/6] failed"));
  EXPECT_THAT(outcome.err, HasSubstr("[1/6] done"));
  EXPECT_EQ(std::distance(fs::directory_iterator(path("out")), {}), 7);
  const Outcome again = run({"batch", "in", "-o", "out", "-j", "1"});
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_THAT(again.err, HasSubstr("unchanged"));
}

TEST_F(Faults, OfReadingHalfWayAreTold) {
  write_file(path("bad.gcode"), squares(1000));
  const Outcome outcome = run({"compensate", "bad.gcode", "-o", "out.gcode"}, "",
                              faulty({{"FAULT_UNREADABLE", "bad.gcode"}}));
  EXPECT_THAT(outcome.exit_code, AnyOf(2, 4));
  EXPECT_THAT(outcome.err, MatchesRegex("bad.gcode(:[0-9]+)?: cannot read.*\n"));
  EXPECT_EQ(read_file(path("out.gcode")), "precious\n");
  EXPECT_THAT(names(), ElementsAre("bad.gcode", "in.gcode", "out.gcode"));
}

TEST_F(Faults, OfAProgramWithoutMemoryLeaveNothing) {
#ifdef UNFLEX_SANITIZED
  GTEST_SKIP() << "sanitizers need more memory than there is room for in any limit";
#endif
  const std::string result = whole();
  int failed = 0;
  for (const std::string jobs : {"2", "200"}) {
    // With less the loader itself fails, before the program begins.
    for (rlim_t megabytes = 32; megabytes <= 80; megabytes += 4) {
      const Outcome outcome =
          run(kToFile + Words{"-q", "-j", jobs}, "", limited(RLIMIT_AS, megabytes << 20U));
      if (outcome.exit_code == 0) {
        // Runs for which memory was lacking are kept.
        EXPECT_TRUE(read_file(path("out.gcode")).ends_with("SHAPER_FREQ_Y=...\n"));
        write_file(path("out.gcode"), "precious\n");
      } else if (outcome.exit_code != 127) {  // 127: no memory to load the libraries
        ++failed;
        expect_refusal(outcome, 4, "unflex: ");
        EXPECT_THAT(outcome.err, HasSubstr("; give -j a smaller number, or end other programs"));
      }
    }
  }
  EXPECT_GT(failed, 0);
}

TEST_F(Faults, OfKillingLeaveTheOldFileOrTheWholeNewOne) {
  const char* const asked = std::getenv("UNFLEX_KILLS");
  const int kills = asked != nullptr ? std::atoi(asked) : 64;
  const std::string result = whole();
  // With and without a solver process.
  const std::vector<Words> engines = {{"--check-solver"}, {}};
  std::vector<microseconds::rep> took;
  for (const Words& engine : engines) {
    const auto begin = steady_clock::now();
    ASSERT_EQ(run(kToFile + Words{"-q"} + engine).exit_code, 0);
    took.push_back(std::chrono::duration_cast<microseconds>(steady_clock::now() - begin).count());
  }
  std::mt19937 random(20240229);  // NOLINT: the same moments every time
  std::uniform_real_distribution<double> share(0.0, 1.1);
  int whole_ones = 0;
  for (int i = 0; i < kills; ++i) {
    const bool in_place = i % 2 == 0;
    const std::size_t engine = i % 8 < 2 ? 0 : 1;
    write_file(path("in.gcode"), small_print());
    write_file(path("out.gcode"), "precious\n");
    const Words words = in_place ? Words{"compensate", "in.gcode", "--in-place"} : kToFile;
    Program program(directory(), words + Words{"-q"} + engines[engine], "", leave_uncounted);
    std::this_thread::sleep_for(microseconds(
        static_cast<microseconds::rep>(share(random) * static_cast<double>(took[engine]))));
    program.signal(SIGKILL);
    static_cast<void>(program.wait());
    const std::string target = read_file(path(in_place ? "in.gcode" : "out.gcode"));
    const std::string old = in_place ? small_print() : "precious\n";
    ASSERT_TRUE(target == old || target == result) << "after " << i << " kills";
    ASSERT_EQ(read_file(path(in_place ? "out.gcode" : "in.gcode")),
              in_place ? "precious\n" : small_print());
    whole_ones += target == result ? 1 : 0;
    Words others = names();
    std::erase_if(others, is_temporary);
    ASSERT_THAT(others, ElementsAre("in.gcode", "out.gcode"));
    // Its solver process is killed too, but may still exist for a moment and hold its file.
    ASSERT_LE(names().size(), 4U);
  }
  EXPECT_LT(whole_ones, kills);
  write_file(path("in.gcode"), small_print());
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  ASSERT_EQ(run(kToFile).exit_code, 0);
  EXPECT_EQ(read_file(path("out.gcode")), result);
  EXPECT_THAT(names(), ElementsAre("in.gcode", "out.gcode"));
  RecordProperty("whole", whole_ones);
}

// After a power cut only synced data are sure to exist; a name may exist without its bytes.
TEST_F(Faults, OfThePowerFindTheBytesOnTheDiskBeforeTheName) {
  ASSERT_EQ(run(kToFile, "", faulty({{"FAULT_LIST", path("list")}})).exit_code, 0);
  EXPECT_EQ(read_file(path("list")), "fsync\nrename\nfsync-folder\n");
}

TEST_F(Faults, OfThePowerLeaveTheOldFileOrTheWholeNewOne) {
  const std::string result = whole();
  for (const std::string call : {"fsync", "rename", "fsync-folder"}) {
    write_file(path("out.gcode"), "precious\n");
    const Outcome outcome = run(kToFile, "", faulty({{"FAULT_KILL", call}}));
    EXPECT_EQ(outcome.exit_code, 128 + SIGKILL) << call;
    EXPECT_EQ(read_file(path("out.gcode")), call == "fsync-folder" ? result : "precious\n");
    EXPECT_EQ(read_file(path("in.gcode")), small_print());
  }
}

TEST_F(Faults, OfRenamingLeaveTheOldFile) {
  for (const std::string call : {"fsync", "rename"}) {
    expect_refusal(run(kToFile, "", faulty({{"FAULT_FAIL", call}})), 4,
                   "out.gcode: cannot write: Input/output error\n");
  }
}

TEST_F(Faults, OfUnpackingAreTold) {
  write_file(path("in.gcode.gz"), container::to_gzip(small_print()));
  const Outcome outcome = run({"compensate", "in.gcode.gz", "-o", "out.gcode"}, "",
                              faulty({{"FAULT_FAIL", "inflate"}}));
  std::filesystem::remove(path("in.gcode.gz"));
  expect_refusal(outcome, 4, "in.gcode.gz: out of memory; end other programs\n");
}

TEST_F(Faults, OfTheClockChangeNothing) {
  const std::string result = whole();
  ASSERT_EQ(run(kToFile, "", faulty({{"FAULT_CLOCK", "1"}})).exit_code, 0);
  EXPECT_EQ(read_file(path("out.gcode")), result);
}

TEST_F(Faults, OfStartingProcessesAreTold) {
  const Words solver = kToFile + Words{"--engine", "ipopt"};
  expect_refusal(
      run(solver, "", faulty({{"FAULT_FAIL", "socketpair"}})), 4,
      "unflex: no solver process: cannot open a socket to another process: Input/output error\n");
  expect_refusal(run(solver, "", faulty({{"FAULT_FAIL", "fork"}})), 4,
                 "unflex: no solver process: cannot fork: Input/output error\n");
}

TEST_F(Faults, OfAPrintOfABatchThatChangesAreTold) {
  std::filesystem::create_directory(path("in"));
  write_file(path("in/a.gcode"), small_print());
  const Outcome outcome =
      run({"batch", "in", "-o", "out", "-q"}, "", faulty({{"FAULT_CHANGE", path("in/a.gcode")}}));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err, "in/a.gcode: changed while it was worked on; run the batch again\n");
  // The batch does not take the print for done.
  EXPECT_EQ(run({"batch", "in", "-o", "out", "-q"}).exit_code, 0);
  EXPECT_TRUE(read_file(path("out/a.gcode")).ends_with("SHAPER_FREQ_Y=...\n"));
}

TEST_F(Faults, OfStartingPrintsOfABatchAreTold) {
  std::filesystem::create_directory(path("in"));
  write_file(path("in/a.gcode"), small_print());
  const Words batch = {"batch", "in", "-o", "out", "-q", "-j", "1"};
  for (const auto& [call, message] : std::vector<std::pair<std::string, std::string>>{
           {"socketpair", "unflex: cannot open a socket to another process: Input/output error\n"},
           {"fork", "unflex: cannot fork: Input/output error\n"}}) {
    const Outcome outcome = run(batch, "", faulty({{"FAULT_FAIL", call}}));
    EXPECT_EQ(outcome.exit_code, 4) << outcome.err;
    EXPECT_EQ(outcome.err, message);
    EXPECT_FALSE(std::filesystem::exists(path("out/a.gcode")));
  }
}

TEST_F(Faults, OfASolverProcessChangeNothing) {
  write_file(path("in.gcode"), small_print() + small_print());
  const Words ipopt = kToFile + Words{"--engine", "ipopt", "-j", "1"};
  ASSERT_EQ(run(ipopt).exit_code, 0);
  const std::string result = read_file(path("out.gcode"));
  Program program(directory(), ipopt);
  pid_t worker = 0;
  const auto deadline = steady_clock::now() + std::chrono::seconds(10);
  while (worker == 0 && steady_clock::now() < deadline) {
    std::ifstream children(fmt::format("/proc/{0}/task/{0}/children", program.pid()));
    children >> worker;
  }
  if (worker != 0) {
    std::this_thread::sleep_for(std::chrono::milliseconds(30));  // the worker is at a window
    ::kill(worker, SIGKILL);
  }
  const Outcome outcome = program.wait();
  if (worker == 0) {
    GTEST_SKIP() << "the kernel does not list children";
  }
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(read_file(path("out.gcode")), result);
}

}  // namespace
}  // namespace unflex::app
