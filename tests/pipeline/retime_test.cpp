#include "retime.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace unflex::pipeline {
namespace {

class Retime : public ::testing::Test {
 protected:
  // The result of retime() for this content.
  static std::string retimed(const std::string& content, double factor) {
    const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / "retime.gcode";
    {
      std::ofstream file(path, std::ios::binary);
      file << content;
    }
    EXPECT_TRUE(retime(path.string(), "retime.gcode", factor).has_value());
    std::ifstream file(path, std::ios::binary);
    std::string result((std::istreambuf_iterator<char>(file)), {});
    std::filesystem::remove(path);
    return result;
  }
};

TEST_F(Retime, KeepsLineEndingsAndEverythingElse) {
  EXPECT_EQ(retimed("M73 P0 R98\r\nG1 X1\r\n\r\n;TIME:10", 2.0),
            "M73 P0 R196\r\nG1 X1\r\n\r\n;TIME:20");
  EXPECT_EQ(retimed("", 2.0), "");
  EXPECT_EQ(retimed("\n\n", 2.0), "\n\n");
}

TEST_F(Retime, FilesOfManyChunksThatGrowAndShrink) {
  std::string content;
  std::string longer;
  std::string shorter;
  // Over 3 MB of lines that all grow or shrink.
  for (int i = 0; i < 150'000; ++i) {
    content += "M73 P0 R50\nG1 X1 Y2\n";
    longer += "M73 P0 R500\nG1 X1 Y2\n";
    shorter += "M73 P0 R5\nG1 X1 Y2\n";
  }
  EXPECT_TRUE(retimed(content, 10.0) == longer);
  EXPECT_TRUE(retimed(content, 0.1) == shorter);
  EXPECT_TRUE(retimed(content, 1.0) == content);
}

TEST_F(Retime, FailsWithoutAFile) {
  const Status status = retime("/nonexistent/file.gcode", "out.gcode", 1.0);
  ASSERT_FALSE(status.has_value());
  EXPECT_EQ(to_string(status.error()).rfind("out.gcode", 0), 0U);
}

}  // namespace
}  // namespace unflex::pipeline
