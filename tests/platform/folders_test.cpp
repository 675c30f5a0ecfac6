#include "unflex/platform/folders.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>

#include "unflex/platform/descriptors.hpp"
#include "unflex/platform/names.hpp"
#include "unflex/platform/replacing.hpp"

namespace unflex::platform {
namespace {

namespace fs = std::filesystem;
using testing::IsEmpty;

class Folders : public testing::Test {
 protected:
  Folders() : folder_(testing::TempDir() + "unflex_folders_" + std::to_string(::getpid())) {
    fs::remove_all(folder_);
    EXPECT_EQ(make_folders(folder_ + "/in/it"), 0);
  }
  ~Folders() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string at(const std::string& name) const { return folder_ + "/" + name; }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(at(name)) << text;
  }
  [[nodiscard]] std::string read(const std::string& name) const {
    std::ifstream stream(at(name));
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  std::string folder_;
};

TEST_F(Folders, ListWhatIsInThem) {
  write("b", "four");
  fs::create_symlink("in", at("link"));
  fs::create_symlink("nowhere", at("astray"));
  ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
  const auto entries = entries_of(folder_);
  ASSERT_TRUE(entries);
  std::string listed;
  for (const FolderEntry& entry : *entries) {
    listed += entry.name + (entry.is_link ? "@" : "") +
              (!entry.kind                      ? "?"
               : entry.kind == FileKind::folder ? "/"
               : entry.kind == FileKind::file   ? "=" + std::to_string(entry.bytes)
                                                : "|") +
              " ";
  }
  EXPECT_EQ(listed, "astray@? b=4 in/ link@/ pipe| ");
  EXPECT_EQ(entries_of(at("none")).error(), ENOENT);
  EXPECT_TRUE(is_taken(at("astray")));
  EXPECT_FALSE(state_of(at("astray")));
  EXPECT_TRUE(is_link(at("astray")));
  EXPECT_FALSE(is_link(at("b")));
}

TEST_F(Folders, GoOnlyWhenTheyAreEmpty) {
  remove_empty_folder(at("in"));
  EXPECT_TRUE(is_taken(at("in")));
  remove_empty_folder(at("in/it"));
  remove_empty_folder(at("in"));
  EXPECT_FALSE(is_taken(at("in")));
  write("file", "");
  EXPECT_EQ(make_folders(at("file/below")), ENOTDIR);
}

TEST_F(Folders, TellFilesApart) {
  write("a", "text");
  fs::create_hard_link(at("a"), at("b"));
  fs::create_symlink("a", at("c"));
  EXPECT_TRUE(same_file(at("a"), at("b")));
  EXPECT_TRUE(same_file(at("a"), at("c")));
  EXPECT_TRUE(same_file(at("new"), at("in/../new")));
  EXPECT_FALSE(same_file(at("a"), at("new")));
  EXPECT_FALSE(same_file("", ""));
}

TEST_F(Folders, SeeThatAFileWasWritten) {
  write("a", "text");
  const FileDescriptor file = open_to_read(at("a"));
  const auto before = state_of(at("a"));
  ASSERT_TRUE(before);
  EXPECT_EQ(before, state_of(file.get()));
  write("a", "more text");
  EXPECT_NE(before, state_of(at("a")));
}

TEST_F(Folders, AreClaimedOnceAloneOrByMany) {
  {
    const auto claim = claim_folder(folder_, Claim::alone);
    ASSERT_TRUE(claim);
    EXPECT_EQ(claim_folder(folder_, Claim::alone).error(), EWOULDBLOCK);
    EXPECT_EQ(claim_folder(folder_, Claim::with_others).error(), EWOULDBLOCK);
  }
  const auto first = claim_folder(folder_, Claim::with_others);
  const auto second = claim_folder(folder_, Claim::with_others);
  EXPECT_TRUE(first);
  EXPECT_TRUE(second);
  EXPECT_EQ(claim_folder(folder_, Claim::alone).error(), EWOULDBLOCK);
}

TEST_F(Folders, KeepLockedFilesAlone) {
  auto made = make_locked_file(folder_);
  ASSERT_TRUE(made);
  EXPECT_TRUE(is_temporary_name(last_part(made->name))) << made->name;
  EXPECT_FALSE(is_temporary_name(".unflex-backup"));
  EXPECT_EQ(remove_unless_locked(made->name), Removal::in_use);
  EXPECT_TRUE(is_taken(made->name));
  made->file = {};
  EXPECT_EQ(remove_unless_locked(made->name), Removal::done);
  EXPECT_FALSE(is_taken(made->name));
}

TEST_F(Folders, HoldNothingOfAnUnnamedFile) {
  const auto file = open_unnamed_file(at("in/it"));
  ASSERT_TRUE(file);
  EXPECT_THAT(*entries_of(at("in/it")), IsEmpty());
  ASSERT_EQ(write_bytes(file->get(), "kept\nwhile open\n"), 16);
  const std::shared_ptr<TextStore> text = descriptor_text(file->get());
  EXPECT_EQ(text->bytes(), 16U);
  // Two read side by side.
  const auto first = text->read();
  const auto second = text->read();
  std::string line;
  ASSERT_TRUE(std::getline(*first, line));
  EXPECT_EQ(line, "kept");
  ASSERT_TRUE(std::getline(*second, line));
  EXPECT_EQ(line, "kept");
  first->seekg(-5, std::ios::end);
  EXPECT_EQ(first->tellg(), 11);
  ASSERT_TRUE(std::getline(*first, line));
  EXPECT_EQ(line, "open");
  EXPECT_FALSE(*text->write());
}

TEST_F(Folders, GiveANewFileThePlaceOfAnother) {
  write("old", "old");
  fs::permissions(at("old"), fs::perms(0640));
  auto made = make_locked_file(folder_);
  ASSERT_TRUE(made);
  ASSERT_EQ(write_bytes(made->file.get(), "new"), 3);
  ASSERT_EQ(take_over_permissions(made->file.get(), at("old")), 0);
  ASSERT_EQ(sync_file(made->file.get()), 0);
  ASSERT_EQ(replace_file(made->name, at("old")), 0);
  sync_folder(folder_);
  EXPECT_EQ(read("old"), "new");
  EXPECT_EQ(fs::status(at("old")).permissions(), fs::perms(0640));
  EXPECT_EQ(replace_file(at("none"), at("old")), ENOENT);
}

}  // namespace
}  // namespace unflex::platform
