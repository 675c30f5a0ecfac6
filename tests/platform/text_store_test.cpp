#include "unflex/core/text_store.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <functional>
#include <istream>
#include <iterator>
#include <ostream>
#include <string>

#include "unflex/platform/files.hpp"

namespace unflex {
namespace {

namespace fs = std::filesystem;

std::string text_of(const TextStore& store) {
  const auto stream = store.read();
  return {std::istreambuf_iterator<char>(*stream), {}};
}

void put(TextStore& store, std::string_view text) {
  const auto stream = store.write();
  *stream << text;
  stream->flush();
  EXPECT_TRUE(*stream);
}

class Stores : public ::testing::TestWithParam<const char*> {
 protected:
  Stores()
      : path_(fs::temp_directory_path() / ("unflex-store-" + std::to_string(::getpid()))),
        store_(std::string_view(GetParam()) == "file" ? platform::file_store(path_)
                                                      : memory_store()) {}
  ~Stores() override { fs::remove(path_); }

  fs::path path_;
  std::shared_ptr<TextStore> store_;
};

TEST_P(Stores, GiveBackWhatWasWrittenAsOftenAsAsked) {
  put(*store_, "G1 X1\nG1 X2");
  EXPECT_EQ(text_of(*store_), "G1 X1\nG1 X2");
  EXPECT_EQ(text_of(*store_), "G1 X1\nG1 X2");
  EXPECT_EQ(store_->bytes(), 11U);
  put(*store_, "M84\n");
  EXPECT_EQ(text_of(*store_), "M84\n");
  EXPECT_EQ(store_->bytes(), 4U);
}

TEST_P(Stores, CanBeReadFromAnywhere) {
  put(*store_, "0123456789");
  const auto stream = store_->read();
  char two[2] = {};
  EXPECT_EQ(stream->read(two, 2).gcount(), 2);
  EXPECT_EQ(stream->tellg(), std::streampos(2));
  stream->seekg(-1, std::ios::end);
  EXPECT_EQ(stream->get(), '9');
  EXPECT_EQ(stream->get(), std::char_traits<char>::eof());
  stream->clear();
  stream->seekg(0);
  EXPECT_EQ(stream->get(), '0');
  stream->seekg(3, std::ios::cur);
  EXPECT_EQ(stream->get(), '4');
}

// Longer than the blocks in which files are worked on, once shorter and once longer afterwards.
TEST_P(Stores, CanBeRewrittenLineByLine) {
  std::string before;
  std::string shorter;
  std::string longer;
  for (int i = 0; i < 300'000; ++i) {
    before += "line " + std::to_string(i) + "\n";
    shorter += std::to_string(i) + "\n";
    longer += "a much longer " + std::to_string(i) + "\n";
  }
  const auto change_to = [](std::string_view word) {
    return [word](std::string_view text, std::string& out) {
      while (!text.empty()) {
        const std::size_t end = text.find('\n') + 1;
        const std::string_view line = text.substr(0, end);
        out += word;
        out += line.substr(line.find_last_of(' ') + 1);
        text.remove_prefix(end);
      }
    };
  };
  put(*store_, before);
  EXPECT_TRUE(store_->rewrite(change_to("a much longer ")));
  EXPECT_TRUE(text_of(*store_) == longer);
  EXPECT_TRUE(store_->rewrite(change_to("")));
  EXPECT_TRUE(text_of(*store_) == shorter);
  EXPECT_EQ(store_->bytes(), shorter.size());
}

INSTANTIATE_TEST_SUITE_P(OfBothKinds, Stores, ::testing::Values("file", "memory"),
                         [](const auto& kind) { return std::string(kind.param); });

TEST(FileStore, TellsWhatCannotBeOpened) {
  const auto store = platform::file_store("/nonexistent/print.gcode");
  EXPECT_FALSE(*store->read());
  EXPECT_FALSE(*store->write());
  EXPECT_FALSE(store->rewrite([](std::string_view, std::string&) {}));
  EXPECT_EQ(store->bytes(), std::nullopt);
}

}  // namespace
}  // namespace unflex
