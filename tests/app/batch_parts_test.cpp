// The parts of a batch, each on its own.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <new>
#include <thread>

#include "batch_files.hpp"
#include "batch_manifest.hpp"
#include "batch_summary.hpp"
#include "batch_workers.hpp"

namespace unflex::app {
namespace {

using ::testing::HasSubstr;

TEST(IsPrint, GoesByTheSuffix) {
  for (const char* name :
       {"a.gcode", "a.GCODE", "a.gco", "a.g", "a.bgcode", "a.gcode.gz", "a.b.g"}) {
    EXPECT_TRUE(is_print(name)) << name;
  }
  for (const char* name : {"a", "gcode", ".gcode", "a.gcode.bak", "a.gz", "a.stl", "a.gcode~"}) {
    EXPECT_FALSE(is_print(name)) << name;
  }
}

TEST(KeyOf, IsAsciiAndTellsNamesApart) {
  EXPECT_EQ(key_of("parts/lid.gcode"), "parts/lid.gcode");
  EXPECT_EQ(key_of("a b%.g"), "a%20b%25.g");
  EXPECT_EQ(key_of("\xff\n"), "%FF%0A");
  EXPECT_NE(key_of("%FF"), key_of("\xff"));
}

TEST(XmlText, HoldsNothingThatIsMarkupOrNoCharacter) {
  EXPECT_EQ(xml_text("a<b> & \"c\""), "a&lt;b&gt; &amp; &quot;c&quot;");
  EXPECT_EQ(xml_text("]]>"), "]]&gt;");
  EXPECT_EQ(xml_text("a\nb\t\r"), "a&#10;b&#9;&#13;");
  EXPECT_EQ(xml_text("µ → 𝄞"), "µ → 𝄞");
  EXPECT_EQ(xml_text(std::string_view("\0\x1b", 2)), "\uFFFD\uFFFD");
  EXPECT_EQ(xml_text("\xff\xc3"), "\uFFFD\uFFFD");            // no UTF-8, cut off
  EXPECT_EQ(xml_text("\xc0\xaf"), "\uFFFD\uFFFD");            // longer than necessary
  EXPECT_EQ(xml_text("\xed\xa0\x80"), "\uFFFD\uFFFD\uFFFD");  // a surrogate
  EXPECT_EQ(xml_text("\xef\xbf\xbf"), "\uFFFD");              // U+FFFF
}

BatchRow row(const std::string& name, BatchState state, int exit_code, const std::string& error) {
  BatchRow made;
  made.name = name;
  made.answer.state = state;
  made.answer.exit_code = exit_code;
  made.answer.error = error;
  return made;
}

TEST(Summary, CountsAndTakesTheWorst) {
  BatchSummary summary;
  EXPECT_EQ(summary.exit_code(), 0);
  summary.rows = {row("a", BatchState::done, 0, ""), row("b", BatchState::failed, 2, "bad"),
                  row("c", BatchState::failed, 3, "strays"),
                  row("d", BatchState::unchanged, 0, "")};
  EXPECT_EQ(summary.exit_code(), 3);
  EXPECT_THAT(total_text(summary), HasSubstr("4 prints: 1 done, 1 unchanged, 2 failed, in "));
  const std::string xml = summary_junit(summary);
  EXPECT_THAT(xml, HasSubstr("tests=\"4\" failures=\"1\" errors=\"1\""));
  EXPECT_THAT(xml, HasSubstr("<error message=\"bad\" type=\"exit code 2\">"));
  EXPECT_THAT(xml, HasSubstr("<failure message=\"strays\" type=\"exit code 3\">"));
}

TEST(Answer, SurvivesItsWayBetweenProcesses) {
  BatchAnswer answer;
  answer.state = BatchState::done;
  answer.exit_code = 0;
  answer.measured = true;
  answer.record = {{"1.0", "a", "b", "c", "d"}, {1.0 / 3.0, 2e-5, 3.0, 4.0, 5.0}};
  answer.messages = {"µ", "two"};
  answer.error = "none";
  const BatchAnswer back = unpack(pack(answer));
  EXPECT_EQ(back.state, answer.state);
  EXPECT_EQ(back.exit_code, 0);
  EXPECT_TRUE(back.measured);
  EXPECT_EQ(back.record.origin, answer.record.origin);
  EXPECT_EQ(back.record.figures.max_before_mm, answer.record.figures.max_before_mm);
  EXPECT_EQ(back.record.figures.print_time_s, 5.0);
  EXPECT_EQ(back.messages, answer.messages);
  EXPECT_EQ(back.error, "none");
  EXPECT_EQ(unpack("{\"state\": 0").state, BatchState::failed);
}

TEST(Processes, ShareTheWorkersThereAre) {
  const BatchWorkers eight(8);
  EXPECT_EQ(eight.workers_for_next(1), 8U);
  EXPECT_EQ(eight.workers_for_next(3), 2U);
  EXPECT_EQ(eight.workers_for_next(100), 1U);
  EXPECT_EQ(eight.workers_for_next(0), 0U);
}

std::vector<BatchWorkers::Done> take_all(BatchWorkers& processes) {
  std::vector<BatchWorkers::Done> all;
  while (processes.any()) {
    for (BatchWorkers::Done& done : processes.take()) {
      all.push_back(std::move(done));
    }
  }
  return all;
}

TEST(Processes, GiveBackTheirWorkers) {
  BatchWorkers processes(3);
  ASSERT_TRUE(processes.start(7, 2, [] {
    BatchAnswer answer;
    answer.state = BatchState::done;
    answer.messages.assign(50'000, "far more than a pipe holds");
    return answer;
  }));
  EXPECT_EQ(processes.workers_for_next(1), 1U);
  const std::vector<BatchWorkers::Done> done = take_all(processes);
  ASSERT_EQ(done.size(), 1U);
  EXPECT_EQ(done[0].ticket, 7U);
  EXPECT_EQ(done[0].answer.messages.size(), 50'000U);
  EXPECT_EQ(processes.workers_for_next(1), 3U);
}

TEST(Processes, SayOfWhatOneDied) {
  BatchWorkers processes(2);
  ASSERT_TRUE(processes.start(1, 1, []() -> BatchAnswer { ::abort(); }));
  ASSERT_TRUE(processes.start(2, 1, []() -> BatchAnswer { ::_exit(0); }));
  std::vector<BatchWorkers::Done> done = take_all(processes);
  ASSERT_EQ(done.size(), 2U);
  if (done[0].ticket == 2) {
    std::swap(done[0], done[1]);
  }
  EXPECT_EQ(done[0].answer.state, BatchState::failed);
  EXPECT_EQ(done[0].answer.exit_code, 4);
  EXPECT_THAT(done[0].answer.error, HasSubstr("died of signal 6"));
  EXPECT_THAT(done[1].answer.error, HasSubstr("without an answer"));
}

TEST(Processes, OutliveOneThatRunsOutOfMemory) {
  BatchWorkers processes(2);
  ASSERT_TRUE(processes.start(1, 1, [] {
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    return BatchAnswer{};
  }));
  ASSERT_TRUE(processes.start(2, 1, []() -> BatchAnswer { throw std::bad_alloc(); }));
  const std::vector<BatchWorkers::Done> done = take_all(processes);
  ASSERT_EQ(done.size(), 2U);
  EXPECT_EQ(done[0].ticket, 2U);
  EXPECT_THAT(done[0].answer.error, HasSubstr("without an answer"));
  EXPECT_TRUE(done[1].answered) << done[1].answer.error;
}

}  // namespace
}  // namespace unflex::app
