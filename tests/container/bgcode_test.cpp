// Binary G-code, against files that libbgcode wrote and its reading of them
// (tests/data/container_*: a cut of a print of our own, in three of the ways it can be packed).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>

#include "container/packed.hpp"

namespace unflex::container {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Pair;

constexpr std::size_t kFileHeaderBytes = 10;

std::uint32_t number(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = count; i-- > 0;) {
    value = value << 8U | static_cast<unsigned char>(bytes[at + i]);
  }
  return value;
}

struct Block {
  std::uint32_t type = 0;
  std::uint32_t compression = 0;
  std::uint32_t encoding = 0;
  std::size_t size = 0;
  std::string bytes;  // all of it
};

std::vector<Block> blocks(std::string_view bytes) {
  std::vector<Block> all;
  for (std::size_t at = kFileHeaderBytes; at < bytes.size();) {
    Block block{number(bytes, at, 2), number(bytes, at + 2, 2), 0, number(bytes, at + 4, 4), {}};
    const std::size_t header = block.compression == 0 ? 8 : 12;
    block.encoding = number(bytes, at + header, 2);
    const std::size_t data = block.compression == 0 ? block.size : number(bytes, at + 8, 4);
    const std::size_t length = header + (block.type == 5 ? 6 : 2) + data + 4;
    block.bytes = bytes.substr(at, length);
    at += length;
    all.push_back(block);
  }
  return all;
}

class LibbgcodeFiles : public ::testing::TestWithParam<const char*> {};

TEST_P(LibbgcodeFiles, AreReadAsLibbgcodeReadsThem) {
  const std::string packed = test_data(std::string("container_") + GetParam() + ".bgcode");
  const std::string text = test_data(std::string("container_") + GetParam() + ".gcode");
  ASSERT_GT(text.size(), 10000U);
  for (const std::size_t piece_bytes : {1U, 4096U, 1000000U}) {
    const Result<Unpacked> unpacked = unpack(packed, piece_bytes);
    ASSERT_TRUE(unpacked) << to_string(unpacked.error());
    EXPECT_EQ(unpacked->text, text);
  }
}

TEST_P(LibbgcodeFiles, KeepAllThatIsNotGcodeByteForByte) {
  const std::string packed = test_data(std::string("container_") + GetParam() + ".bgcode");
  const Unpacked unpacked = *unpack(packed);
  const std::vector<Block> before = blocks(packed);
  const Compression metadata = static_cast<Compression>(before[3].compression);
  const std::string again = *to_bgcode(unpacked.text, &unpacked.metadata, {.metadata = metadata});
  const std::vector<Block> after = blocks(again);
  ASSERT_EQ(after.size(), before.size());
  for (std::size_t i = 0; i + 1 < before.size(); ++i) {
    // Heatshrink may pack one text in several ways. Only the unpacked text is the same.
    if (metadata != Compression::heatshrink_12_4 || before[i].compression == 0) {
      EXPECT_EQ(after[i].bytes, before[i].bytes) << "block " << i;
    }
  }
  EXPECT_EQ(unpack(again)->text, unpacked.text);
}

INSTANTIATE_TEST_SUITE_P(Bgcode, LibbgcodeFiles,
                         ::testing::Values("default", "heatshrink_11_meatpack", "deflate_plain"));

TEST(Bgcode, HasPrusaSlicersBlocks) {
  const std::string text = test_data("container_print.gcode");
  const std::string packed = *to_bgcode(text);
  EXPECT_EQ(packed.substr(0, kFileHeaderBytes), std::string_view("GCDE\1\0\0\0\1\0", 10));
  std::string order;
  for (const Block& block : blocks(packed)) {
    order += std::to_string(block.type) + std::to_string(block.compression) +
             std::to_string(block.encoding) + " ";
  }
  EXPECT_EQ(order, "000 300 500 410 210 132 ");
}

TEST(Bgcode, IsTheSamePrintAsLibbgcodeMakesOfTheText) {
  const Unpacked ours = *unpack(
      *to_bgcode(test_data("container_print.gcode"), nullptr, {.encoding = Encoding::meatpack}));
  const Unpacked theirs = *unpack(test_data("container_heatshrink_11_meatpack.bgcode"));
  EXPECT_EQ(ours.metadata.file, theirs.metadata.file);
  EXPECT_EQ(ours.metadata.slicer, theirs.metadata.slicer);
  EXPECT_EQ(ours.metadata.print, theirs.metadata.print);
  // Our order differs: it is that of PrusaSlicer 2.8 itself.
  EXPECT_THAT(ours.metadata.printer, ::testing::UnorderedElementsAreArray(theirs.metadata.printer));
  ASSERT_EQ(ours.metadata.thumbnails.size(), 1U);
  EXPECT_EQ(ours.metadata.thumbnails[0].data, theirs.metadata.thumbnails[0].data);
  EXPECT_EQ(ours.metadata.thumbnails[0].width, 64);
  const auto gcode = [](const std::string& text) {
    const std::size_t begin = text.find("thumbnail end\n;\n");
    return text.substr(begin, text.find("\n; filament used [mm]", begin) - begin);
  };
  EXPECT_EQ(gcode(ours.text), gcode(theirs.text));
}

TEST(Bgcode, ComesBackInEveryCompressionAndEncoding) {
  std::mt19937 random(8);
  for (const Compression compression :
       {Compression::none, Compression::deflate, Compression::heatshrink_11_4,
        Compression::heatshrink_12_4}) {
    for (const Encoding encoding :
         {Encoding::none, Encoding::meatpack, Encoding::meatpack_comments}) {
      for (const bool checksum : {false, true}) {
        const std::string text =
            random_gcode(random, 1 + random() % 6000, encoding != Encoding::meatpack);
        const BgcodeOptions options{compression, compression, encoding, checksum};
        const Result<Unpacked> unpacked = unpack(*to_bgcode(text, nullptr, options));
        ASSERT_TRUE(unpacked) << to_string(unpacked.error());
        // Without metadata there are blank lines around the text.
        EXPECT_EQ(unpacked->text, "\n" + text + "\n");
      }
    }
  }
}

TEST(Bgcode, TakesMetadataFromTheEndAlone) {
  const std::string body =
      "; total toolchanges = 0\nG28\n; filament cost = 99\nG1 X1\n; filament cost = 98\nM84\n";
  const std::string packed = *to_bgcode(body + "; filament cost = 1.25\n");
  const Unpacked unpacked = *unpack(packed);
  EXPECT_THAT(unpacked.text, HasSubstr(body.substr(body.find("G28"))));
  EXPECT_THAT(unpacked.metadata.print, Contains(Pair("filament cost", "1.25")));
  const Unpacked again = *unpack(*to_bgcode(unpacked.text, &unpacked.metadata));
  EXPECT_EQ(again.text, unpacked.text);
  EXPECT_EQ(again.metadata.print, unpacked.metadata.print);
}

TEST(Bgcode, IsTheSameHoweverTheTextIsCut) {
  const std::string text = test_data("container_print.gcode");
  const std::string packed = *to_bgcode(text);
  EXPECT_EQ(*pack(*make_bgcode_packer("out", nullptr), text, 1), packed);
  EXPECT_EQ(*pack(*make_bgcode_packer("out", nullptr), text, text.size()), packed);
}

TEST(Bgcode, HasBlocksOfAtMost64KiBOfText) {
  std::mt19937 random(9);
  const std::string text = random_gcode(random, 20000, true);
  const std::string packed =
      *to_bgcode(text, nullptr, {.gcode = Compression::none, .encoding = Encoding::none});
  std::size_t sum = 0;
  for (const Block& block : blocks(packed)) {
    EXPECT_LE(block.size, 65536U);
    sum += block.type == 1 ? block.size : 0;
  }
  EXPECT_EQ(sum, text.size());
  EXPECT_GT(text.size(), 4U * 65536U);
}

TEST(Bgcode, HasNoRoomForALineOfMoreThan64KiB) {
  EXPECT_TRUE(to_bgcode(";" + std::string(65534, 'x') + "\n"));
  const Result<std::string> packed = to_bgcode(";" + std::string(65535, 'x') + "\n");
  ASSERT_FALSE(packed);
  EXPECT_THAT(to_string(packed.error()), HasSubstr("out.bgcode: the print has a line longer"));
  EXPECT_FALSE(to_bgcode(std::string(3U << 20U, 'x')));
}

TEST(Bgcode, TextThatWouldBeACommandOfMeatpackIsNotPacked) {
  const std::string text = "M117 \xff\xff\xfa G1\nG1 X1\n";
  EXPECT_THAT(unpack(*to_bgcode(text))->text, HasSubstr(text));
}

TEST(Bgcode, LinesMayEndAsInWindowsOrNotAtAll) {
  EXPECT_EQ(unpack(*to_bgcode("G28\r\n\r\n;TYPE:X\r\nG1 X1"))->text, "\nG28\n;TYPE:X\nG1 X1\n\n");
}

TEST(Bgcode, OfAnEmptyTextIsAnEmptyPrint) {
  EXPECT_EQ(essential(unpack(*to_bgcode(""))->text), "");
  EXPECT_EQ(essential(unpack(*to_bgcode("\n;\n"))->text), "");
}

}  // namespace
}  // namespace unflex::container
