// What people see on the terminal.

#include "console.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "progress.hpp"

namespace unflex::app {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using namespace std::chrono_literals;

TEST(OneLine, HasNoControlCharacters) {
  EXPECT_EQ(one_line("a\nb\r\tc\x1b[31md\x7f\n\n"), "a b  c?[31md?");
  EXPECT_EQ(one_line("µm → 3"), "µm → 3");
}

TEST(Bar, FillsTheRoomThereIs) {
  EXPECT_EQ(bar_text("solving", 0.5, "", 40), "solving [###########------------]  50 %");
  for (std::size_t columns = 0; columns < 200; ++columns) {
    for (const double fraction : {-1.0, 0.0, 0.333, 1.0, 2.0}) {
      EXPECT_LE(bar_text("solving", fraction, "59 min left", columns).size(), columns);
    }
  }
}

TEST(Bar, IsOnlyFullAtTheEnd) {
  EXPECT_THAT(bar_text("solving", 0.9999, "", 60), EndsWith("-]  99 %"));
  EXPECT_THAT(bar_text("solving", 1.0, "", 60), EndsWith("#] 100 %"));
}

TEST(Bar, IsTheStageAloneWhileTheFractionIsUnknown) {
  EXPECT_EQ(bar_text("reading", -1.0, "", 60), "reading");
}

TEST(Bar, TellsTheTimeLeftWhereThereIsRoom) {
  EXPECT_EQ(bar_text("solving", 0.5, "3 min left", 52),
            "solving [###########------------]  50 %, 3 min left");
  EXPECT_EQ(bar_text("solving", 0.5, "3 min left", 30), "solving [######-------]  50 %");
}

TEST(TimeLeft, IsWrittenAsPeopleWould) {
  const std::vector<std::pair<double, std::string>> cases = {
      {0.0, "5 s left"},          {5.0, "5 s left"},          {36.0, "40 s left"},
      {60.0, "60 s left"},        {61.0, "2 min left"},       {180.0, "3 min left"},
      {3540.0, "59 min left"},    {3541.0, "1 h 0 min left"}, {3660.0, "1 h 5 min left"},
      {7790.0, "2 h 10 min left"}};
  for (const auto& [seconds, text] : cases) {
    EXPECT_EQ(time_left_text(TimeLeft::Seconds(seconds)), text) << seconds;
  }
}

class TimeLeftTest : public ::testing::Test {
 protected:
  // The estimate after `seconds` more, in seconds; −1 for none.
  double after(double seconds, double fraction, std::string_view stage = "solving") {
    now_ += std::chrono::duration_cast<TimeLeft::TimePoint::duration>(TimeLeft::Seconds(seconds));
    const std::optional<TimeLeft::Seconds> left = time_left_.update(stage, fraction, now_);
    return left ? left->count() : -1.0;
  }

  TimeLeft time_left_;
  TimeLeft::TimePoint now_{};
};

TEST_F(TimeLeftTest, NeedsSecondsAndPercents) {
  EXPECT_EQ(after(0.0, 0.0), -1.0);
  EXPECT_EQ(after(1.0, 0.5), -1.0);
  EXPECT_EQ(after(1.0, 0.6), -1.0);
  EXPECT_NEAR(after(2.0, 0.8), 2.0, 0.1);
}

TEST_F(TimeLeftTest, IsNotToldOfOnePercentHoweverLongItTook) {
  EXPECT_EQ(after(0.0, 0.0), -1.0);
  EXPECT_EQ(after(100.0, 0.01), -1.0);
  EXPECT_NEAR(after(300.0, 0.04), 9600.0, 100.0);
}

TEST_F(TimeLeftTest, OfSteadyWorkIsExactAndNeverRises) {
  static_cast<void>(after(0.0, 0.0));
  double last = 1e9;
  for (int i = 1; i <= 990; ++i) {
    const double left = after(0.1, i / 1000.0);
    if (left >= 0.0) {
      EXPECT_NEAR(left, 100.0 - 0.1 * i, 1e-6);
      EXPECT_LT(left, last);
      last = left;
    }
  }
  EXPECT_LT(last, 2.0);
}

TEST_F(TimeLeftTest, OfUnsteadyWorkDoesNotJump) {
  static_cast<void>(after(0.0, 0.0));
  int corrections = 0;
  double last = -1.0;
  for (int i = 1; i <= 180; ++i) {
    // Every second 0.5 %, but a tenth to and fro.
    const double left = after(1.0, 0.005 * i + 0.0005 * (i % 2));
    corrections += last >= 0.0 && std::abs(left - (last - 1.0)) > 1e-6 ? 1 : 0;
    last = left;
  }
  EXPECT_LE(corrections, 2);
}

TEST_F(TimeLeftTest, FollowsWorkThatBecomesSlower) {
  static_cast<void>(after(0.0, 0.0));
  for (int i = 1; i <= 50; ++i) {
    static_cast<void>(after(1.0, 0.01 * i));
  }
  // Now a fifth of the speed, and 0.3 left after 100 s more: 150 s.
  double left = 0.0;
  for (int i = 1; i <= 100; ++i) {
    left = after(1.0, 0.5 + 0.002 * i);
  }
  EXPECT_NEAR(left, 150.0, 0.2 * 150.0);
}

TEST_F(TimeLeftTest, StartsAgainWithAnotherStageAndWhenTheStageStartsAgain) {
  static_cast<void>(after(0.0, 0.0));
  static_cast<void>(after(2.0, 0.2));
  EXPECT_NEAR(after(2.0, 0.4), 6.0, 0.1);
  EXPECT_EQ(after(0.1, 0.4, "verifying"), -1.0);
  EXPECT_EQ(after(2.0, 0.5, "verifying"), -1.0);
  EXPECT_NEAR(after(2.0, 0.6, "verifying"), 8.0, 0.1);
  EXPECT_EQ(after(0.1, 0.0, "verifying"), -1.0);
  EXPECT_EQ(after(1.0, -1.0, "verifying"), -1.0);
}

// A progress bar that writes to a pipe instead of a terminal.
class BarOnAPipe : public ::testing::Test {
 protected:
  BarOnAPipe() { EXPECT_EQ(::pipe(ends_.data()), 0); }
  ~BarOnAPipe() override { ::close(ends_[0]); }

  std::string written() {
    ::close(ends_[1]);
    std::string text;
    std::array<char, 4096> block{};
    for (ssize_t got = 0; (got = ::read(ends_[0], block.data(), block.size())) > 0;) {
      text.append(block.data(), static_cast<std::size_t>(got));
    }
    return text;
  }

  std::array<int, 2> ends_{};
};

std::ptrdiff_t redraws(const std::string& text) {
  return std::count(text.begin(), text.end(), '\r');
}

TEST_F(BarOnAPipe, IsRedrawnAtMostTenTimesASecond) {
  std::chrono::steady_clock::time_point now{};
  {
    ProgressBar bar(ends_[1], [&now] { return now; });
    for (int millisecond = 0; millisecond < 1000; ++millisecond) {
      now += 1ms;
      bar.update("solving", millisecond / 1000.0);
    }
  }
  EXPECT_EQ(redraws(written()), 10 + 1);  // 10 times drawn, once cleared
}

TEST_F(BarOnAPipe, TellsTheTimeLeftOnceItIsKnown) {
  std::chrono::steady_clock::time_point now{};
  {
    ProgressBar bar(ends_[1], [&now] { return now; });
    for (int second = 0; second <= 10; ++second) {
      bar.update("solving", second / 100.0);
      now += 1s;
    }
  }
  const std::string text = written();
  EXPECT_THAT(text, HasSubstr("]   2 %\r"));
  EXPECT_THAT(text, HasSubstr("]   3 %, 2 min left\r"));
  EXPECT_THAT(text, HasSubstr("]  10 %, 2 min left\r"));
}

TEST_F(BarOnAPipe, IsOneLineThatTellsOfMinutesIfItMayNotBeRedrawn) {
  std::chrono::steady_clock::time_point now{};
  OneEstimate estimate(ends_[1], [&now] { return now; });
  for (int second = 0; second <= 100; ++second) {
    estimate.update("solving", second / 100.0);  // a minute and a half
    now += 1s;
  }
  for (int second = 0; second <= 50; ++second) {
    estimate.update("verifying", second / 50.0);  // less than a minute
    now += 1s;
  }
  EXPECT_EQ(written(), "unflex: solving, 2 min left\n");
}

TEST_F(BarOnAPipe, IsClearedAtTheEnd) {
  { ProgressBar(ends_[1]).update("solving", 0.25); }
  const std::string text = written();
  EXPECT_THAT(text, StartsWith("\r\033[Ksolving ["));
  EXPECT_THAT(text, EndsWith("\r\033[K"));
}

TEST_F(BarOnAPipe, WritesNothingIfNothingHappened) {
  { const ProgressBar bar(ends_[1]); }
  EXPECT_THAT(written(), IsEmpty());
}

TEST(Colours, AreOfTheWordWarningAndOfAnErrorsPlace) {
  EXPECT_EQ(coloured_line("a.gcode:3: warning: odd"), "a.gcode:3: \033[1;33mwarning:\033[0m odd");
  EXPECT_EQ(coloured_line("[1/2] done"), "[1/2] done");
  EXPECT_EQ(coloured_error({ErrorKind::input, {"a: b.gcode", 7}, "no: good"}),
            "\033[1;31ma: b.gcode:7: \033[0mno: good");
  EXPECT_EQ(coloured_error({ErrorKind::usage, {}, "no good"}), "\033[1;31munflex: \033[0mno good");
}

// A console on a terminal, and what it writes there.
class ConsoleOnATerminal : public ::testing::Test {
 protected:
  ConsoleOnATerminal() {
    EXPECT_EQ(::openpty(&master_, &slave_, nullptr, nullptr, nullptr), 0);
    ::setenv("TERM", "xterm", 1);
    ::unsetenv("NO_COLOR");
  }
  ~ConsoleOnATerminal() override {
    ::close(master_);
    ::close(slave_);
    ::unsetenv("NO_COLOR");
    ::unsetenv("TERM");
  }

  std::string said() {
    Console console(slave_);
    console.line("x: warning: odd");
    console.error({ErrorKind::usage, {}, "wrong"});
    EXPECT_THAT(console.kept(), ElementsAre("x: warning: odd", "unflex: wrong"));
    // A terminal may hand them over one by one.
    constexpr std::ptrdiff_t kLines = 2;
    std::string text;
    std::array<char, 4096> block{};
    while (std::ranges::count(text, '\n') < kLines) {
      const ssize_t got = ::read(master_, block.data(), block.size());
      if (got <= 0) {
        break;
      }
      text.append(block.data(), static_cast<std::size_t>(got));
    }
    return text;
  }

  int master_ = -1;
  int slave_ = -1;
};

constexpr const char* kWithoutColours = "x: warning: odd\r\nunflex: wrong\r\n";

TEST_F(ConsoleOnATerminal, HasColours) {
  EXPECT_EQ(said(), "x: \033[1;33mwarning:\033[0m odd\r\n\033[1;31munflex: \033[0mwrong\r\n");
}

TEST_F(ConsoleOnATerminal, HasNoColoursIfTheUserWantsNone) {
  ::setenv("NO_COLOR", "1", 1);
  EXPECT_EQ(said(), kWithoutColours);
}

TEST_F(ConsoleOnATerminal, TakesAnEmptyNoColorForNone) {
  ::setenv("NO_COLOR", "", 1);
  EXPECT_NE(said(), kWithoutColours);
}

TEST_F(ConsoleOnATerminal, HasNoColoursIfItIsDumb) {
  ::setenv("TERM", "dumb", 1);
  EXPECT_EQ(said(), kWithoutColours);
}

TEST_F(BarOnAPipe, LetsNoColoursPass) {
  ::setenv("TERM", "xterm", 1);
  {
    Console console(ends_[1]);
    console.line("x: warning: odd");
    console.error({ErrorKind::usage, {}, "wrong"});
  }
  EXPECT_EQ(written(), "x: warning: odd\nunflex: wrong\n");
}

}  // namespace
}  // namespace unflex::app
