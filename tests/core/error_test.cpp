#include "unflex/core/error.hpp"

#include <gtest/gtest.h>

namespace unflex {
namespace {

TEST(Error, NamesFileAndLineBeforeTheMessage) {
  EXPECT_EQ(to_string(Error{ErrorKind::input, {"part.gcode", 12}, "line too long"}),
            "part.gcode:12: line too long");
}

TEST(Error, LeavesOutWhatIsUnknown) {
  EXPECT_EQ(to_string(Error{ErrorKind::input, {"part.gcode", 0}, "no such file"}),
            "part.gcode: no such file");
  EXPECT_EQ(to_string(Error{ErrorKind::usage, {"", 3}, "no value"}), "line 3: no value");
  EXPECT_EQ(to_string(Error{ErrorKind::usage, {}, "no value"}), "no value");
}

TEST(Error, DiagnosticsCallThemselvesWarnings) {
  EXPECT_EQ(to_string(Diagnostic{{"a.gcode", 7}, "check the line"}),
            "a.gcode:7: warning: check the line");
  EXPECT_EQ(to_string(Diagnostic{{}, "check"}), "warning: check");
}

TEST(Error, FailCarriesKindPlaceAndMessage) {
  const Status status = fail(ErrorKind::usage, {"unflex.toml", 4}, "unknown key");
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(status.error().kind, ErrorKind::usage);
  EXPECT_EQ(to_string(status.error()), "unflex.toml:4: unknown key");
  const Result<int> result = fail(ErrorKind::internal, "disk full");
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().kind, ErrorKind::internal);
  EXPECT_EQ(to_string(result.error()), "disk full");
}

}  // namespace
}  // namespace unflex
