// Gzip.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <random>

#include "container/packed.hpp"

namespace unflex::container {
namespace {

using ::testing::HasSubstr;

// printf 'G28\n' | gzip --no-name
constexpr std::string_view kG28 = std::string_view(
    "\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03\x73\x37\xb2\xe0\x02\x00"
    "\x83\xdb\x22\xf7\x04\x00\x00\x00",
    24);

std::string message(std::string_view bytes) {
  const Result<Unpacked> unpacked = unpack(bytes);
  return unpacked ? "no error" : to_string(unpacked.error());
}

TEST(Gzip, IsKnownByItsFirstBytes) {
  EXPECT_EQ(detect(kG28), Kind::gzip);
  EXPECT_EQ(detect("G28\n"), Kind::text);
  EXPECT_EQ(detect(""), Kind::text);
  EXPECT_EQ(detect("GCDE"), Kind::bgcode);
  EXPECT_EQ(detect("GCD"), Kind::text);
}

TEST(Gzip, IsExpectedByNames) {
  EXPECT_EQ(kind_of_name("a.gcode.gz"), Kind::gzip);
  EXPECT_EQ(kind_of_name("a.GZ"), Kind::gzip);
  EXPECT_EQ(kind_of_name("a.bgcode"), Kind::bgcode);
  EXPECT_EQ(kind_of_name("a.bgc"), Kind::bgcode);
  EXPECT_EQ(kind_of_name("a.bgcode.gcode"), Kind::text);
  EXPECT_EQ(kind_of_name("-"), Kind::text);
}

TEST(Gzip, UnpacksWhatGzipPacked) { EXPECT_EQ(unpack(kG28)->text, "G28\n"); }

TEST(Gzip, ComesBackHoweverItIsCut) {
  std::mt19937 random(5);
  for (const std::size_t lines : {0U, 1U, 100U, 20000U}) {
    const std::string text = random_gcode(random, lines, true);
    const std::string packed = to_gzip(text);
    EXPECT_EQ(unpack(packed)->text, text);
    if (lines <= 100) {
      EXPECT_EQ(unpack(packed, 1)->text, text);
    }
    EXPECT_EQ(*pack(*make_gzip_packer(), text, 777), packed);
  }
}

TEST(Gzip, PassesItsTextOnWhileItComes) {
  std::mt19937 random(6);
  const std::string text = random_gcode(random, 6000, true);
  const std::unique_ptr<Packer> packer = make_gzip_packer();
  const std::unique_ptr<Unpacker> unpacker = make_unpacker(Kind::gzip, "print");
  ASSERT_GT(text.size(), 2U * 65536U);
  unpacker->push(*packer->push(std::string_view(text).substr(0, 65536)));
  std::string came;
  for (std::string piece = *unpacker->pull(); !piece.empty(); piece = *unpacker->pull()) {
    came += piece;
  }
  EXPECT_EQ(came, text.substr(0, 65536));
}

TEST(Gzip, MembersFollowEachOther) {
  const std::string packed = std::string(kG28) + to_gzip("G1 X1\n") + to_gzip("");
  EXPECT_EQ(unpack(packed)->text, "G28\nG1 X1\n");
  EXPECT_EQ(unpack(packed, 1)->text, "G28\nG1 X1\n");
}

TEST(Gzip, MayBeFilledUpWithZeros) {
  const std::string packed = std::string(kG28) + std::string(512, '\0');
  EXPECT_EQ(unpack(packed)->text, "G28\n");
  EXPECT_THAT(message(packed + "x"), HasSubstr("comes something else (byte 536)"));
}

TEST(Gzip, MayNotBeFollowedByAnythingElse) {
  EXPECT_EQ(message(std::string(kG28) + "G1 X1\n"),
            "print: after the gzip data comes something else (byte 24); cut it off or get the file "
            "again");
  EXPECT_THAT(message(std::string(kG28) + "\x1f"), HasSubstr("(byte 24)"));
}

TEST(Gzip, IsMissedWhenItIsCutOff) {
  for (std::size_t length = 2; length < kG28.size(); ++length) {
    EXPECT_THAT(message(kG28.substr(0, length)), HasSubstr("end too early")) << length;
  }
}

TEST(Gzip, IsChecked) {
  std::string packed(kG28);
  packed[17] = static_cast<char>(packed[17] ^ 1);
  EXPECT_THAT(message(packed), HasSubstr("damaged near byte"));
  EXPECT_THAT(message(packed), HasSubstr("incorrect data check"));
}

TEST(Gzip, BombsComeInSmallPieces) {
  const std::string packed = to_gzip(std::string(std::size_t{64} << 20U, '0'));
  EXPECT_LT(packed.size(), 200000U);
  const Result<Unpacked> unpacked = unpack(packed, packed.size());
  EXPECT_EQ(unpacked->text.size(), std::size_t{64} << 20U);
  EXPECT_LE(unpacked->longest_piece, 65536U);
}

}  // namespace
}  // namespace unflex::container
