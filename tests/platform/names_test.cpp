#include "unflex/platform/names.hpp"

#include <gtest/gtest.h>

#include <filesystem>

namespace unflex::platform {
namespace {

namespace fs = std::filesystem;

// The C++ library knows the same on this system.
TEST(Names, HaveTheirPartsAsTheLibrarySays) {
  for (const std::string name : {"", "a", "a/b", "/a", "/", "a/", "a//b", "/a/b.c", "b.c", "a.b/c",
                                 ".c", "a/.c", "..", "a/..", "a.tar.gz", "x.", "./a", "a/b/"}) {
    EXPECT_EQ(folder_of(name), fs::path(name).parent_path().string()) << name;
    EXPECT_EQ(last_part(name), fs::path(name).filename().string()) << name;
    EXPECT_EQ(ending_of(name), fs::path(name).extension().string()) << name;
    EXPECT_EQ(with_ending(name, ".html"), fs::path(name).replace_extension(".html").string())
        << name;
    for (const std::string folder : {"", "a", "a/", "/", "../b"}) {
      EXPECT_EQ(joined(folder, name), (fs::path(folder) / name).string()) << folder << " " << name;
    }
  }
}

}  // namespace
}  // namespace unflex::platform
