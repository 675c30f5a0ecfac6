// What people see on the terminal.

#include "console.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "progress.hpp"

namespace unflex::app {
namespace {

using ::testing::EndsWith;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using namespace std::chrono_literals;

TEST(OneLine, HasNoControlCharacters) {
  EXPECT_EQ(one_line("a\nb\r\tc\x1b[31md\x7f\n\n"), "a b  c?[31md?");
  EXPECT_EQ(one_line("µm → 3"), "µm → 3");
}

TEST(Bar, FillsTheRoomThereIs) {
  EXPECT_EQ(bar_text("solving", 0.5, 40), "solving [###########------------]  50 %");
  for (std::size_t columns = 0; columns < 200; ++columns) {
    for (const double fraction : {-1.0, 0.0, 0.333, 1.0, 2.0}) {
      EXPECT_LE(bar_text("solving", fraction, columns).size(), columns);
    }
  }
}

TEST(Bar, IsOnlyFullAtTheEnd) {
  EXPECT_THAT(bar_text("solving", 0.9999, 60), EndsWith("-]  99 %"));
  EXPECT_THAT(bar_text("solving", 1.0, 60), EndsWith("#] 100 %"));
}

TEST(Bar, IsTheStageAloneWhileTheFractionIsUnknown) {
  EXPECT_EQ(bar_text("reading", -1.0, 60), "reading");
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

}  // namespace
}  // namespace unflex::app
