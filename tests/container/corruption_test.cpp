// Damaged binary files.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <array>

#include "container/packed.hpp"

namespace unflex::container {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

std::string message(std::string_view bytes) {
  const Result<Unpacked> unpacked = unpack(bytes);
  EXPECT_TRUE(unpacked || unpacked.error().kind == ErrorKind::input);
  return unpacked ? "no error" : to_string(unpacked.error());
}

std::string bytes_of(std::uint32_t value, std::size_t count) {
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) {
    bytes += static_cast<char>(value >> (8 * i) & 255U);
  }
  return bytes;
}

// A file without checksums, block by block: type, parameters, data.
struct Part {
  std::uint32_t type = 0;
  std::string data = "";
  std::uint32_t encoding = 0;
  std::uint32_t compression = 0;
};

std::string file_of(const std::vector<Part>& parts) {
  std::string file = "GCDE" + bytes_of(1, 4) + bytes_of(0, 2);
  for (const Part& part : parts) {
    file += bytes_of(part.type, 2) + bytes_of(part.compression, 2) +
            bytes_of(static_cast<std::uint32_t>(part.data.size()), 4);
    file += part.compression != 0 ? bytes_of(static_cast<std::uint32_t>(part.data.size()), 4) : "";
    file += bytes_of(part.encoding, 2) + (part.type == 5 ? bytes_of(1, 2) + bytes_of(1, 2) : "");
    file += part.data;
  }
  return file;
}

constexpr std::uint32_t kFile = 0, kGcode = 1, kSlicer = 2, kPrinter = 3, kPrint = 4, kThumb = 5;

TEST(BrokenBgcode, HandmadeFilesAreRead) {
  EXPECT_EQ(message(file_of({{kFile, "a=b\n"},
                             {kPrinter},
                             {kThumb, "x"},
                             {kThumb, "x"},
                             {kPrint},
                             {kSlicer, "a=b\n"},
                             {kSlicer, "{}", 1},
                             {kGcode, "G28\n"},
                             {kGcode}})),
            "no error");
  EXPECT_EQ(
      unpack(file_of({{kPrinter}, {kPrint}, {kSlicer}, {kGcode, "G1"}, {kGcode, " X1"}}))->text,
      "\nG1 X1\n\n");
}

TEST(BrokenBgcode, BlocksHaveAnOrder) {
  EXPECT_EQ(
      message(file_of({{kPrinter}, {kPrint}, {kSlicer}, {kGcode}, {kPrint}})),
      "print: block at byte 50 is print metadata behind G-code; the file is damaged, export it "
      "again");
  EXPECT_THAT(message(file_of({{kPrinter}, {kPrinter}})),
              HasSubstr("is printer metadata behind printer metadata"));
  EXPECT_THAT(message(file_of({{kFile}, {kThumb}})),
              HasSubstr("is thumbnail, but there is no printer metadata before it"));
  EXPECT_THAT(message(file_of({{kPrinter}, {kSlicer}})), HasSubstr("no print metadata before it"));
  EXPECT_THAT(message(file_of({{kPrinter}, {kPrint}, {kGcode}})),
              HasSubstr("no slicer metadata before it"));
  EXPECT_THAT(message(file_of({{kPrinter}, {kPrint}, {kSlicer, "a=1\n"}, {kSlicer, "a=1\n"}})),
              HasSubstr("slicer metadata for a second time"));
}

TEST(BrokenBgcode, CodesAreKnownOrRefused) {
  std::string newer = file_of({});
  newer[4] = 2;
  EXPECT_EQ(message(newer),
            "print: is binary G-code of version 2, of which only 1 is known; export it as plain "
            "G-code");
  std::string checksum = file_of({});
  checksum[8] = 9;
  EXPECT_THAT(message(checksum), HasSubstr("checksums of the unknown type 9"));
  EXPECT_THAT(message(file_of({{6}})), HasSubstr("block at byte 10 has the unknown type 6"));
  EXPECT_THAT(message(file_of({{kPrinter, "", 0, 4}})), HasSubstr("packed in the unknown way 4"));
  EXPECT_THAT(message(file_of({{kPrinter, "", 1}})), HasSubstr("in the unknown encoding 1"));
  EXPECT_THAT(message(file_of({{kPrinter}, {kThumb, "x", 3}})),
              HasSubstr("thumbnail of the unknown format 3"));
  EXPECT_THAT(message(file_of({{kPrinter}, {kPrint}, {kSlicer}, {kGcode, "", 3}})),
              HasSubstr("encoded in the unknown way 3"));
  EXPECT_THAT(message(file_of({{kPrinter, "no sign\n"}})), HasSubstr("not key=value"));
  EXPECT_THAT(message(file_of({{kPrinter, "junk", 0, 1}})), HasSubstr("cannot be unpacked"));
  EXPECT_THAT(message(file_of({{kPrinter, "ju", 0, 3}})), HasSubstr("cannot be unpacked"));
}

TEST(BrokenBgcode, ClaimsOfEndlessBlocksCostNothing) {
  std::string file = file_of({{kPrinter}});
  file.replace(14, 4, "\xff\xff\xff\x7f");
  EXPECT_EQ(message(file),
            "print: block at byte 10 claims to be of 2147483647 bytes; the file is "
            "damaged, export it again");
}

TEST(BrokenBgcode, MetadataHaveAnEnd) {
  const Part picture{kThumb, std::string(std::size_t{14} << 20U, 'x')};
  EXPECT_THAT(message(file_of({{kPrinter}, picture, picture, picture, picture, picture})),
              HasSubstr("is the one with which metadata exceed 67108864 bytes"));
}

TEST(BrokenBgcode, IsMissedWhereverItIsCutOff) {
  const std::string file = test_data("container_default.bgcode");
  for (std::size_t length = 4; length < file.size(); ++length) {
    ASSERT_THAT(message(file.substr(0, length)),
                AnyOf(HasSubstr("get the whole file"), HasSubstr("without any G-code")))
        << length;
  }
  EXPECT_EQ(message(file.substr(0, 9)),
            "print: ends at byte 9, within its header; get the whole file");
  EXPECT_EQ(message(file.substr(0, 20)),
            "print: ends at byte 20, within the block at byte 10; get the whole file");
}

TEST(BrokenBgcode, MayNotBeFollowedByAnything) {
  const std::string file = test_data("container_default.bgcode");
  EXPECT_THAT(message(file + "junkjunkjunk"), HasSubstr("has the unknown type"));
  EXPECT_THAT(message(file + "x"), HasSubstr("within the block at byte"));
}

TEST(BrokenBgcode, IsChecked) {
  std::string file = test_data("container_default.bgcode");
  file[file.size() - 100] = static_cast<char>(file[file.size() - 100] ^ 4);
  EXPECT_THAT(message(file), HasSubstr("does not match its checksum"));
}

// One bit is changed. With checksums there is an error, or the same text if the bit means nothing.
// Without checksums there may be another text, but never a crash or an endless loop.
TEST(BrokenBgcode, NeverPassesForAnother) {
  std::mt19937 random(12);
  const std::string text = test_data("container_print.gcode").substr(2300, 3000);
  for (const bool checksum : {true, false}) {
    for (const Compression compression :
         {Compression::none, Compression::deflate, Compression::heatshrink_12_4}) {
      const std::string file = *to_bgcode(
          text, nullptr, {compression, compression, Encoding::meatpack_comments, checksum});
      const std::string whole = unpack(file)->text;
      for (int draw = 0; draw < 400; ++draw) {
        std::string damaged = file;
        const std::size_t at = 4 + random() % (file.size() - 4);
        damaged[at] = static_cast<char>(damaged[at] ^ (1 << random() % 8));
        const Result<Unpacked> unpacked = unpack(damaged);
        if (checksum && at != 8 && at != 9) {
          EXPECT_TRUE(!unpacked || unpacked->text == whole) << "byte " << at;
        }
      }
    }
  }
}

// Bytes by chance behind the beginning of a file never make a whole one: they are refused, or the
// file ends too early.
TEST(BrokenBgcode, OfAnyBytesIsRefused) {
  std::mt19937 random(13);
  for (int draw = 0; draw < 2000; ++draw) {
    std::string file =
        file_of({{kPrinter}, {kPrint}, {kSlicer}}).substr(0, 10 + 10 * (random() % 4));
    for (std::size_t left = random() % 200; left > 0; --left) {
      file += static_cast<char>(random() % 2 == 0 ? random() % 6 : random());
    }
    const Result<Unpacked> unpacked = unpack(file, 1 + random() % 50);
    ASSERT_FALSE(unpacked.has_value()) << "draw " << draw;
    EXPECT_EQ(unpacked.error().kind, ErrorKind::input);
    EXPECT_FALSE(unpacked.error().message.empty());
  }
}

// A gzip file with a changed bit gives an error or the same text.
TEST(BrokenGzip, NeverPassesForAnother) {
  std::mt19937 random(14);
  const std::string text = test_data("container_print.gcode").substr(0, 5000);
  const std::string file = to_gzip(text);
  for (int draw = 0; draw < 2000; ++draw) {
    std::string damaged = file;
    const std::size_t at = 2 + random() % (file.size() - 2);
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random() % 8));
    const Result<Unpacked> unpacked = unpack(damaged);
    EXPECT_TRUE(!unpacked || unpacked->text == text) << "byte " << at;
  }
}

}  // namespace
}  // namespace unflex::container
