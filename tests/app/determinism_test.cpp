// A print gives equal bytes, wherever, whenever and however the program is run.

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "app/program.hpp"
#include "paths.hpp"

namespace unflex::app {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

struct Made {
  std::string output;
  nlohmann::json report;  // without the performance figures

  bool operator==(const Made&) const = default;
};

class Bytes : public ProgramTest {
 protected:
  // Klipper gets a piece of a real print. The other firmwares get a small one, because the search
  // for the end of each line is slow.
  void choose(const std::string& firmware) {
    firmware_ = firmware;
    write_file(path("in.gcode"), firmware == "klipper" ? read_file(fs::path(test_paths::kData) /
                                                                   "pipeline_washer_arcs.gcode")
                                                       : small_print());
  }

  [[nodiscard]] Words words(const Words& more = {}) const {
    Words all = {"compensate", "in.gcode", "-o", "out.gcode", "--report", "r.json"};
    // A band of frequencies, as by default, which asks most of threads.
    all.insert(all.end(), {"--set", fmt::format("printer.firmware={}", firmware_), "--set",
                           "dynamics.freq_error=0.1"});
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  // The output and the report, which are then deleted.
  [[nodiscard]] Made take() const {
    Made made{read_file(path("out.gcode")),
              nlohmann::json::parse(read_file(path("r.json")), nullptr, false)};
    EXPECT_TRUE(made.report.contains("performance"));
    made.report.erase("performance");
    fs::remove(path("out.gcode"));
    fs::remove(path("r.json"));
    return made;
  }

  [[nodiscard]] Made make(const Words& more = {}, const std::function<void()>& prepare = {}) const {
    const Outcome outcome = run(words(more), "", prepare);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return take();
  }

 private:
  std::string firmware_;
};

class Determinism : public Bytes, public ::testing::WithParamInterface<const char*> {
 protected:
  Determinism() { choose(GetParam()); }
};

TEST_P(Determinism, HoldsForAnyNumberOfWorkersAndEveryTime) {
  const Made first = make();
  ASSERT_GT(first.output.size(), read_file(path("in.gcode")).size());
  for (const char* const jobs : {"1", "2", "3", "7"}) {
    EXPECT_TRUE(make({"-j", jobs}) == first) << "-j " << jobs;
  }
  for (int i = 0; i < 4; ++i) {
    EXPECT_TRUE(make() == first) << "time " << i + 2;
  }
}

TEST_P(Determinism, HoldsForEitherWayToAskForTheEngine) {
  const Made with_check = make({"--check-solver"});
  EXPECT_GT(with_check.report["solver"]["checked_windows"], 0);
  const Made banded = make({"--engine", "banded"});
  EXPECT_EQ(banded.output, with_check.output);
  EXPECT_EQ(banded.report["deviation"], with_check.report["deviation"]);
  EXPECT_TRUE(make({"--engine", "banded", "-j", "3"}) == banded);
}

TEST_P(Determinism, HoldsForEitherWidthOfRegisters) {
  const Made first = make();
  EXPECT_TRUE(make({}, [] { ::setenv("UNFLEX_LANES", "2", 1); }) == first);
}

// The C library chooses its functions by processor, and unflex its registers.
TEST_P(Determinism, HoldsOnAnOlderProcessor) {
  const auto is_old = [] {
    ::setenv("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA,-AVX2,-FMA4", 1);
    ::setenv("UNFLEX_LANES", "2", 1);
  };
  for (const Words& timing :
       {Words{}, Words{"--faster"}, Words{"--faster", "--timing", "optimal"}}) {
    const Made first = make(timing);
    EXPECT_TRUE(make(timing, is_old) == first) << fmt::format("{}", fmt::join(timing, " "));
  }
}

TEST_P(Determinism, HoldsInAnyEnvironment) {
  const Made first = make();
  const auto with = [](const char* name, const char* value) {
    return [name, value] { ::setenv(name, value, 1); };
  };
  for (const char* const zone : {"Asia/Kathmandu", "America/St_Johns", ":nonsense"}) {
    EXPECT_TRUE(make({}, with("TZ", zone)) == first) << zone;
  }
  EXPECT_TRUE(make({}, [] {
                for (const char* const name : {"HOME", "PATH", "TERM", "LANG", "USER", "TMPDIR"}) {
                  ::unsetenv(name);
                }
              }) == first);
}

// Locales with decimal commas, grouped digits, or an i whose capital is not I.
TEST_F(Bytes, AreTheSameUnderAnyLocale) {
  const std::string folder = path("locales");
  fs::create_directory(folder);
  for (const std::string language : {"de_DE", "tr_TR"}) {
    const std::string build =
        fmt::format("localedef -i {0} -f UTF-8 {1}/{0}.UTF-8 >/dev/null 2>&1", language, folder);
    if (std::system(build.c_str()) != 0) {
      GTEST_SKIP() << "localedef cannot make " << language;
    }
  }
  for (const char* const firmware : {"klipper", "marlin", "rrf"}) {
    choose(firmware);
    const Words exact = {"--set", "dynamics.freq_error=0"};
    const Made first = make(exact);
    for (const char* const locale : {"C", "de_DE.UTF-8", "tr_TR.UTF-8"}) {
      EXPECT_TRUE(make(exact,
                       [&] {
                         ::setenv("LOCPATH", folder.c_str(), 1);
                         ::setenv("LC_ALL", locale, 1);
                       }) == first)
          << firmware << ", " << locale;
    }
  }
}

TEST_P(Determinism, HoldsFromAnyFolderAndByAnyName) {
  const Made first = make();
  fs::create_directory(path("elsewhere"));
  Words there = words();
  for (const std::size_t name : {1U, 3U, 5U}) {
    there[name] = "../" + there[name];
  }
  const auto moved = [&] { static_cast<void>(::chdir(path("elsewhere").c_str())); };
  EXPECT_EQ(run(there, "", moved).exit_code, 0);
  EXPECT_EQ(take().output, first.output);
  for (const std::size_t name : {1U, 3U, 5U}) {
    there[name] = path(words()[name]);
  }
  EXPECT_EQ(run(there, "", moved).exit_code, 0);
  Made absolute = take();
  // The report has names as they were given.
  absolute.report["input"] = "in.gcode";
  absolute.report["output"] = "out.gcode";
  EXPECT_TRUE(absolute == first);
}

TEST_P(Determinism, HoldsOnATerminal) {
  const Made first = make();
  Words all = with_dynamics(words());
  all.insert(all.begin(), "unflex");
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, nullptr);
  if (child < 0) {
    GTEST_SKIP() << "there are no pseudo-terminals";
  }
  if (child == 0) {
    std::vector<char*> argv;
    for (std::string& word : all) {
      argv.push_back(word.data());
    }
    argv.push_back(nullptr);
    ::setenv("TERM", "xterm", 1);
    if (::chdir(directory().c_str()) == 0) {
      ::execv(test_paths::kProgram, argv.data());
    }
    ::_exit(127);
  }
  std::string shown;
  std::array<char, 4096> block{};
  for (ssize_t got = 0; (got = ::read(terminal, block.data(), block.size())) > 0;) {
    shown.append(block.data(), static_cast<std::size_t>(got));
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ::close(terminal);
  EXPECT_EQ(status, 0) << shown;
  EXPECT_THAT(shown, ::testing::HasSubstr("\033[K")) << "no progress bar";
  EXPECT_TRUE(take() == first);
}

INSTANTIATE_TEST_SUITE_P(Of, Determinism, ::testing::Values("klipper", "marlin", "rrf"),
                         [](const auto& firmware) { return std::string(firmware.param); });

}  // namespace
}  // namespace unflex::app
