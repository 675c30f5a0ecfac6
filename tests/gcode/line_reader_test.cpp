#include <gtest/gtest.h>

#include <random>
#include <sstream>
#include <streambuf>
#include <string>
#include <vector>

#include "unflex/gcode/line.hpp"

namespace unflex::gcode {
namespace {

std::vector<Line> read_all(const std::string& bytes) {
  std::istringstream stream(bytes);
  LineReader reader(stream, "test.gcode");
  std::vector<Line> lines;
  Line line;
  while (true) {
    const Result<bool> more = reader.next(line);
    if (!more.has_value()) {
      ADD_FAILURE() << to_string(more.error());
      return lines;
    }
    if (!*more) {
      break;
    }
    lines.push_back(line);
  }
  EXPECT_EQ(reader.bytes_read(), bytes.size());
  return lines;
}

std::string joined(const std::vector<Line>& lines) {
  std::string text;
  for (const Line& line : lines) {
    text += line.text;
  }
  return text;
}

// The error of the first line that cannot be read.
Error first_error(std::istream& stream) {
  LineReader reader(stream, "test.gcode");
  Line line;
  Result<bool> more = true;
  while (more.has_value() && *more) {
    more = reader.next(line);
  }
  EXPECT_FALSE(more.has_value());
  return more.has_value() ? Error{} : more.error();
}

TEST(LineReader, KeepsEveryKindOfLineEnding) {
  const std::vector<Line> lines = read_all("G28\nG1 X1\r\n\n\r\na\rb\nlast");
  ASSERT_EQ(lines.size(), 6U);
  EXPECT_EQ(lines[0].text, "G28\n");
  EXPECT_EQ(lines[1].text, "G1 X1\r\n");
  EXPECT_EQ(lines[1].content(), "G1 X1");
  EXPECT_EQ(lines[2].content(), "");
  EXPECT_EQ(lines[3].text, "\r\n");
  EXPECT_EQ(lines[3].content(), "");
  EXPECT_EQ(lines[4].content(), "a\rb") << "a lone carriage return is no line ending";
  EXPECT_EQ(lines[5].text, "last");
  EXPECT_EQ(lines[5].content(), "last");
  EXPECT_EQ(lines[5].number, 6U);
}

TEST(LineReader, GivesNothingForAnEmptyFile) { EXPECT_TRUE(read_all("").empty()); }

TEST(LineReader, EndsWithTheLastNewline) { EXPECT_EQ(read_all("a\nb\n").size(), 2U); }

TEST(LineReader, GivesTheInputBackWhateverItsLines) {
  std::mt19937_64 random(2);
  std::uniform_int_distribution<int> byte(1, 255);
  std::uniform_int_distribution<std::size_t> length(0, 300'000);
  for (int round = 0; round < 8; ++round) {
    std::string bytes;
    // Lines longer than a block as well as many short ones.
    while (bytes.size() < 1'500'000) {
      const std::size_t size = round % 2 == 0 ? length(random) % 60 : length(random);
      for (std::size_t i = 0; i < size; ++i) {
        const char c = static_cast<char>(byte(random));
        bytes.push_back(c == '\n' ? '\r' : c);
      }
      bytes += "\n";
    }
    const std::vector<Line> lines = read_all(bytes);
    ASSERT_EQ(joined(lines), bytes);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      ASSERT_EQ(lines[i].number, i + 1);
      ASSERT_EQ(lines[i].text.find('\n'), lines[i].text.size() - 1);
    }
  }
}

TEST(LineReader, CallsBytesWithNulNoText) {
  std::istringstream stream(std::string("G1 X1\nG1 \0X2\nG1", 15));
  const Error error = first_error(stream);
  EXPECT_EQ(error.kind, ErrorKind::input);
  EXPECT_EQ(to_string(error),
            "test.gcode:2: not a text file (NUL byte); pass G-code as plain text");
}

TEST(LineReader, TakesALineOfOneMebibyteAndNoMore) {
  const std::string longest(1024 * 1024 - 1, 'x');
  EXPECT_EQ(read_all(longest + "\nb").size(), 2U);
  std::istringstream stream("a\n" + longest + "x\n");
  const Error error = first_error(stream);
  EXPECT_EQ(error.kind, ErrorKind::input);
  EXPECT_EQ(error.place.line, 2U);
  EXPECT_NE(error.message.find("1 MiB"), std::string::npos);
}

class BrokenDisk : public std::streambuf {
 protected:
  int_type underflow() override { throw std::ios_base::failure("broken"); }
};

// Gives its texts one by one, and remembers how many it was asked for.
class Portions final : public std::streambuf {
 public:
  explicit Portions(std::vector<std::string> texts) : texts_(std::move(texts)) {}
  [[nodiscard]] std::size_t given() const { return given_; }

 protected:
  int_type underflow() override {
    if (given_ == texts_.size()) {
      return traits_type::eof();
    }
    std::string& text = texts_[given_++];
    setg(text.data(), text.data(), text.data() + text.size());
    return traits_type::to_int_type(*gptr());
  }

 private:
  std::vector<std::string> texts_;
  std::size_t given_ = 0;
};

TEST(LineReader, GivesALineAsSoonAsItIsThere) {
  Portions portions({"a\nb\nc", "c\nd", "\n", "e"});
  std::istream stream(&portions);
  LineReader reader(stream, "test.gcode");
  Line line;
  const std::vector<std::pair<std::string, std::size_t>> expected = {
      {"a\n", 1}, {"b\n", 1}, {"cc\n", 2}, {"d\n", 3}, {"e", 4}};
  for (const auto& [text, given] : expected) {
    ASSERT_TRUE(reader.next(line).value());
    EXPECT_EQ(line.text, text);
    EXPECT_EQ(portions.given(), given);
  }
  EXPECT_FALSE(reader.next(line).value());
}

TEST(LineReader, ReportsAStreamThatFails) {
  BrokenDisk disk;
  std::istream stream(&disk);
  const Error error = first_error(stream);
  EXPECT_EQ(error.kind, ErrorKind::internal);
  EXPECT_EQ(error.place.file, "test.gcode");
}

}  // namespace
}  // namespace unflex::gcode
