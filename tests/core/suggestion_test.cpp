#include "unflex/core/suggestion.hpp"

#include <gtest/gtest.h>

namespace unflex {
namespace {

TEST(Suggestion, IsTheNearestName) {
  const std::vector<std::string_view> names = {"--output", "--in-place", "--printer"};
  EXPECT_EQ(suggestion("--ouput", names), ", did you mean '--output'?");
  EXPECT_EQ(suggestion("--pritner", names), ", did you mean '--printer'?");
}

TEST(Suggestion, IsNoneIfNothingIsNear) {
  EXPECT_EQ(suggestion("frobnicate", {"compensate", "batch"}), "");
  EXPECT_EQ(suggestion("compensate", {}), "");
}

TEST(Suggestion, KnowsANameInAnotherSectionAndWithoutItsUnit) {
  const std::vector<std::string_view> names = {"limits.max_accel_mm_s2", "emit.period_ms"};
  EXPECT_EQ(suggestion("solve.period_ms", names), ", did you mean 'emit.period_ms'?");
  EXPECT_EQ(suggestion("limits.max_accel", names), ", did you mean 'limits.max_accel_mm_s2'?");
}

}  // namespace
}  // namespace unflex
