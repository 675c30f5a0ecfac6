// Warnings about lines, of which one that says the same of many is told once.
#include "line_warnings.hpp"

#include <gmock/gmock.h>

namespace unflex::pipeline {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::string> texts(const LineWarnings& warnings) {
  std::vector<std::string> texts;
  for (const Diagnostic& warning : warnings.list("in.gcode")) {
    texts.push_back(to_string(warning));
  }
  return texts;
}

TEST(LineWarnings, AreNoneAtFirst) { EXPECT_THAT(texts({}), IsEmpty()); }

TEST(LineWarnings, ThatDifferInTheirNumbersAreToldOnce) {
  LineWarnings warnings;
  for (std::size_t line = 1; line <= 40; ++line) {
    warnings.add(line, "the arc's end is 0." + std::to_string(line) + " mm off");
  }
  warnings.add(3, "a word is given twice");
  warnings.add(90, "a word is given twice");
  warnings.add(2, "once");
  EXPECT_THAT(texts(warnings),
              ElementsAre("in.gcode:1: warning: the arc's end is 0.1 mm off (likewise 39 more "
                          "lines, the last one 40)",
                          "in.gcode:2: warning: once",
                          "in.gcode:3: warning: a word is given twice (and line 90)"));
}

TEST(LineWarnings, OfEndlessKindsAreCounted) {
  LineWarnings warnings;
  for (std::size_t i = 0; i < 1005; ++i) {
    warnings.add(i + 1, std::string(i + 1, 'x'));
  }
  const std::vector<std::string> list = texts(warnings);
  ASSERT_EQ(list.size(), 1001U);
  EXPECT_EQ(list.back(), "in.gcode: warning: 5 more warnings are not listed");
}

}  // namespace
}  // namespace unflex::pipeline
