// Heatshrink.

#include "heatshrink.hpp"

#include <gtest/gtest.h>

#include <random>

namespace unflex::container {
namespace {

// From the description: literals A and B (1 and 8 bits each), then 6 bytes from 2 back: 0, eleven
// bits of 1, four bits of 5, filled up with zeros.
//   1 01000001  1 01000010  0 00000000001 0101  000000
constexpr std::string_view kAbabababPacked = "\xa0\xd0\x80\x05\x40";

TEST(Heatshrink, UnpacksAVectorMadeByHand) {
  EXPECT_EQ(unheatshrink(kAbabababPacked, 11, 8), "ABABABAB");
}

TEST(Heatshrink, PacksAVectorMadeByHand) { EXPECT_EQ(heatshrink("ABABABAB", 11), kAbabababPacked); }

TEST(Heatshrink, ReadsZerosFromBeforeTheBeginning) {
  // 0, twelve bits of 0, four bits of 2: three bytes from 1 back.
  EXPECT_EQ(unheatshrink(std::string_view("\x00\x01\x00", 3), 12, 3), std::string(3, '\0'));
}

TEST(Heatshrink, ComesBack) {
  std::mt19937 random(11);
  for (int draw = 0; draw < 60; ++draw) {
    const std::size_t symbols = 1 + random() % (draw % 3 == 0 ? 256 : 4);
    std::string bytes;
    for (std::size_t left = random() % 20000; left > 0; --left) {
      bytes += static_cast<char>(random() % symbols);
    }
    for (const unsigned window_bits : {11U, 12U}) {
      ASSERT_EQ(unheatshrink(heatshrink(bytes, window_bits), window_bits, bytes.size()), bytes);
    }
  }
}

TEST(Heatshrink, FindsWhatIsAWindowAwayAndNotFurther) {
  for (const unsigned window_bits : {11U, 12U}) {
    std::mt19937 random(1);
    std::string bytes;
    for (std::size_t i = 0; i < (std::size_t{1} << window_bits); ++i) {
      bytes += static_cast<char>(random());
    }
    const std::size_t alone = heatshrink(bytes, window_bits).size();
    const std::string repeated = bytes + bytes.substr(0, 16);
    // A reference takes one bit, the window's bits and four: 16 or 17.
    EXPECT_LE(heatshrink(repeated, window_bits).size(), alone + 3);
    EXPECT_GE(heatshrink(bytes + "?" + bytes.substr(0, 16), window_bits).size(), alone + 5);
  }
}

// Sixteen bytes cost 17 bits.
TEST(Heatshrink, IsSmallForWhatRepeatsItself) {
  const std::string bytes(1U << 18U, 'a');
  const std::string packed = heatshrink(bytes, 12);
  EXPECT_LT(packed.size(), bytes.size() / 7);
  EXPECT_EQ(unheatshrink(packed, 12, bytes.size()), bytes);
}

TEST(Heatshrink, RefusesTooFewAndTooManyBytes) {
  EXPECT_FALSE(unheatshrink(kAbabababPacked.substr(0, 4), 11, 8));
  EXPECT_FALSE(unheatshrink(kAbabababPacked, 11, 7));
  EXPECT_FALSE(unheatshrink(kAbabababPacked, 11, 2));
  EXPECT_FALSE(unheatshrink(kAbabababPacked, 11, 9));
  EXPECT_FALSE(unheatshrink("", 11, 1));
  EXPECT_EQ(unheatshrink("", 11, 0), "");
}

}  // namespace
}  // namespace unflex::container
