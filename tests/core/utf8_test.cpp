#include "unflex/core/utf8.hpp"

#include <gtest/gtest.h>

namespace unflex {
namespace {

TEST(FirstUtf8, IsTheCharacterThatATextBeginsWith) {
  const auto expect = [](std::string_view text, std::size_t length, char32_t value) {
    EXPECT_EQ(first_utf8(text).length, length) << text;
    EXPECT_EQ(first_utf8(text).value, value) << text;
  };
  expect("az", 1, U'a');
  expect("\u00e4z", 2, 0xe4);
  expect("\u20acz", 3, 0x20ac);
  expect("\U0010ffffz", 4, 0x10ffff);
}

TEST(FirstUtf8, IsNoneWhereBytesAreNot) {
  for (const std::string_view text :
       {"\x80", "\xff", "\xc3", "\xc3z", "\xc0\x80", "\xe0\x80\x80", "\xed\xa0\x80",
        "\xf0\x80\x80\x80", "\xf4\x90\x80\x80", "\xe2\x82"}) {
    EXPECT_EQ(first_utf8(text).length, 0U);
  }
}

}  // namespace
}  // namespace unflex
