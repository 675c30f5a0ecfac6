#include "unflex/platform/files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <istream>
#include <iterator>
#include <ostream>
#include <string>

#include "unflex/platform/usage.hpp"

namespace unflex::platform {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

class Files : public ::testing::Test {
 protected:
  Files() : folder_(fs::temp_directory_path() / ("unflex-files-" + std::to_string(::getpid()))) {
    fs::create_directories(folder_ / "macros");
    for (const char* const name : {"printer.cfg", "macros/b.cfg", "macros/a.cfg", "macros/a.txt"}) {
      *write_file(path(name)) << name;
    }
    fs::create_symlink("nowhere.cfg", folder_ / "lost.cfg");
  }
  ~Files() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_ / name).string();
  }

  fs::path folder_;
};

TEST_F(Files, AreFoundByPatternsInOrder) {
  EXPECT_THAT(matching_files(path("macros/*.cfg")),
              ElementsAre(path("macros/a.cfg"), path("macros/b.cfg")));
  EXPECT_THAT(matching_files(path("macros/[b-z].cfg")), ElementsAre(path("macros/b.cfg")));
  EXPECT_THAT(matching_files(path("macros/c*")), IsEmpty());
  EXPECT_THAT(matching_files(path("missing.cfg")), IsEmpty());
  EXPECT_THAT(matching_files(path("lost.cfg")), ElementsAre(path("lost.cfg")));
}

TEST_F(Files, AreSeenFromThoseBesideThem) {
  EXPECT_EQ(name_beside(path("printer.cfg"), "macros/*.cfg"), path("macros/*.cfg"));
  EXPECT_EQ(name_beside("printer.cfg", "macros.cfg"), "macros.cfg");
  EXPECT_EQ(name_beside(path("printer.cfg"), "/etc/macros.cfg"), "/etc/macros.cfg");
}

TEST_F(Files, HaveOneNameWhateverLeadsToThem) {
  EXPECT_EQ(canonical_name(path("macros/../printer.cfg")), canonical_name(path("printer.cfg")));
  EXPECT_NE(canonical_name(path("macros/a.cfg")), canonical_name(path("macros/b.cfg")));
}

TEST_F(Files, AreToldFromFoldersAndFromNothing) {
  EXPECT_TRUE(exists(path("printer.cfg")));
  EXPECT_TRUE(exists(path("macros")));
  EXPECT_FALSE(exists(path("lost.cfg")));
  EXPECT_TRUE(is_directory(path("macros")));
  EXPECT_FALSE(is_directory(path("printer.cfg")));
  EXPECT_EQ(file_bytes(path("printer.cfg")), 11U);
  EXPECT_EQ(file_bytes(path("lost.cfg")), std::nullopt);
}

TEST_F(Files, CanBeWrittenOverAndShortened) {
  {
    const auto stream = change_file(path("printer.cfg"));
    stream->seekp(8);
    *stream << "txt";
  }
  EXPECT_TRUE(shorten_file(path("printer.cfg"), 10));
  const auto stream = read_file(path("printer.cfg"));
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(*stream), {}), "printer.tx");
  EXPECT_FALSE(*change_file(path("missing.cfg")));
  EXPECT_FALSE(shorten_file(path("missing.cfg"), 0));
}

TEST(Usage, IsThatOfThisProcess) {
  const double before_s = processor_s();
  volatile double sum = 0.0;
  for (int i = 0; i < 50'000'000; ++i) {
    sum = sum + 1.0;
  }
  EXPECT_GT(processor_s(), before_s);
  EXPECT_GT(peak_memory_mb(), 1.0);
  EXPECT_LT(peak_memory_mb(), 1000.0);
}

}  // namespace
}  // namespace unflex::platform
