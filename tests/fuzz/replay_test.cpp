// Replays the stored corpus of fuzzing, including inputs that once broke something.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "paths.hpp"
#include "targets.hpp"

namespace unflex::fuzz {
namespace {

std::vector<std::filesystem::path> corpus(const std::string& target) {
  const auto folder = std::filesystem::path(test_paths::kData).parent_path() / "fuzz" / "corpus";
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder / target)) {
    files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

void expect_holds(const std::string& target, void (*holds)(std::string_view)) {
  const std::vector<std::filesystem::path> files = corpus(target);
  EXPECT_GE(files.size(), 10U);
  for (const std::filesystem::path& file : files) {
    std::ifstream stream(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(stream), {}};
    EXPECT_NO_THROW(holds(bytes)) << file;
  }
  EXPECT_NO_THROW(holds("")) << "nothing at all";
}

TEST(FuzzCorpus, HoldsForGcode) { expect_holds("gcode", gcode); }
TEST(FuzzCorpus, HoldsForWholePrints) { expect_holds("compensate", compensate); }
TEST(FuzzCorpus, HoldsForSettings) { expect_holds("settings", settings); }
TEST(FuzzCorpus, HoldsForPackedFiles) { expect_holds("container", container); }
TEST(FuzzCorpus, HoldsForRecords) { expect_holds("records", records); }

}  // namespace
}  // namespace unflex::fuzz
