// MeatPack.

#include "meatpack.hpp"

#include <gtest/gtest.h>

#include <random>

#include "container/packed.hpp"

namespace unflex::container {
namespace {

constexpr std::string_view kStart = "\xff\xff\xfb\xff\xff\xf7";

TEST(Meatpack, PacksAVectorMadeByHand) {
  // G1 X1 Y: (G 1) (X 1) (whole Y, line end), and an empty line to make room.
  EXPECT_EQ(meatpack("G1 X1 Y\n", true), std::string(kStart) + "\x1d\x1e\xcfY\xcc");
  // (E 8) with E for a space; M: (whole M, 8).
  EXPECT_EQ(meatpack("M8E8\n", true), std::string(kStart) + "\x8fM\x8b\xcc");
  // Both characters whole.
  EXPECT_EQ(meatpack("MM\n", true), std::string(kStart) + "\xffMM\xcc");
}

TEST(Meatpack, LeavesCommentLinesUnpacked) {
  EXPECT_EQ(meatpack(";TYPE:X\nG1\n", true),
            std::string(kStart) + "\xff\xff\xfa;TYPE:X\n\xff\xff\xfb\x1d\xcc");
  EXPECT_EQ(meatpack(";TYPE:X\nG1 ; x\n", false), std::string(kStart) + "\x1d\xcc\xff\xff\xf9");
}

TEST(Meatpack, UnpacksWhatPrusaSlicerDoesAndOthers) {
  // With spaces packed, as Prusa's firmware had them first.
  EXPECT_EQ(unmeatpack("\xff\xff\xfb\x1d\xeb\xc1"), "G1 X1\n");
  // Line ends twice, as libbgcode writes them.
  EXPECT_EQ(unmeatpack(std::string(kStart) + "\x1d\x1e\xcc\xcc\x1d\x1e\xcc\xcc"), "G1 X1\nG1 X1\n");
  // Not packed at all.
  EXPECT_EQ(unmeatpack("G1X1\n"), "G1X1\n");
}

TEST(Meatpack, KeepsWhatIsNoPlainGCommand) {
  for (const std::string line :
       {"M117 G1 x E e\n", "GO_HOME X E\n", "g1 x1 e1\n", "G1  X1\n", "N3 G1 X1*57\n",
        "PRINT_START NAME=G28 E=1\n", "M23 \"ÄÖ 1.G\"\n", "G\n", " G1 X1\n", "; X  G1\n",
        "G28 X Y Z\n", "G1 X-.5 Y+1 E.1 ; WIPE OVER\n", "G92 E0\n", "G4 P1;GAP\n"}) {
    EXPECT_EQ(unmeatpack(meatpack(line, true)), line);
  }
}

TEST(Meatpack, DropsNoSpacesButThoseBetweenWords) {
  EXPECT_EQ(unmeatpack(meatpack("G1 X1  \nM84 \t\n", true)), "G1 X1  \nM84 \t\n");
  EXPECT_EQ(unmeatpack(meatpack("G1X1Y2\n", true)), "G1 X1 Y2\n");
}

TEST(Meatpack, ComesBack) {
  std::mt19937 random(2);
  for (int draw = 0; draw < 50; ++draw) {
    const std::string text = random_gcode(random, 200, true);
    ASSERT_EQ(unmeatpack(meatpack(text, true)), text);
    const std::string commands = random_gcode(random, 200, false);
    ASSERT_EQ(unmeatpack(meatpack(commands, false)), commands);
  }
}

// If the text were packed smaller, libbgcode's reader would lose characters.
TEST(Meatpack, PacksToNoLessThanHalfTheText) {
  std::mt19937 random(3);
  for (int draw = 0; draw < 50; ++draw) {
    const std::string text = random_gcode(random, 1 + draw, false);
    EXPECT_GE(2 * meatpack(text, false).size(), text.size() + 2);
  }
  EXPECT_GE(2 * meatpack("G1 X1 E1\nG1 X1 E1\nG1 X1 E1\nG1 X1 E1\nG1 X1 E1\n", true).size(), 45U);
}

TEST(Meatpack, MakesATextOfAnyBytes) {
  std::mt19937 random(4);
  for (int draw = 0; draw < 2000; ++draw) {
    std::string bytes;
    for (std::size_t left = random() % 60; left > 0; --left) {
      bytes += static_cast<char>(random() % 3 == 0 ? 0xff : random());
    }
    EXPECT_LE(unmeatpack(bytes).size(), 4 * bytes.size());
  }
}

}  // namespace
}  // namespace unflex::container
