#include "unflex/core/number.hpp"

#include <gtest/gtest.h>

#include <charconv>
#include <clocale>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <string>

namespace unflex {
namespace {

std::string scaled(std::int64_t value, int decimals) {
  std::string out;
  append_scaled(out, value, decimals);
  return out;
}

TEST(ParseNumber, ReadsWhatPrintersAndSlicersWrite) {
  EXPECT_EQ(parse_number("1"), 1.0);
  EXPECT_EQ(parse_number("+1"), 1.0);
  EXPECT_EQ(parse_number(".5"), 0.5);
  EXPECT_EQ(parse_number("-.8"), -0.8);
  EXPECT_EQ(parse_number("+.25"), 0.25);
  EXPECT_EQ(parse_number("3."), 3.0);
  EXPECT_EQ(parse_number("-0"), 0.0);
  EXPECT_EQ(parse_number("007.50"), 7.5);
  EXPECT_EQ(parse_number("7800.000"), 7800.0);
}

TEST(ParseNumber, GivesTheNearestDoubleForAnyNumberOfDigits) {
  std::mt19937 random(7);  // NOLINT: the same numbers every time
  for (int i = 0; i < 20'000; ++i) {
    std::string text = random() % 2 == 0 ? "-" : "";
    const std::size_t digits = 1 + random() % 20;
    const std::size_t point = random() % (digits + 1);
    for (std::size_t d = 0; d < digits; ++d) {
      text += d == point ? "." : "";
      text += static_cast<char>('0' + random() % 10);
    }
    double expected = 0.0;
    std::from_chars(text.data(), text.data() + text.size(), expected);
    EXPECT_EQ(parse_number(text), expected) << text;
  }
}

TEST(ParseNumber, RefusesEverythingElse) {
  for (const char* text :
       {"",    "+",   "-",    ".",   "-.",   "+-1", "--1", "++1", "-+1", "1-2", "1.2.3",
        "1e5", "1E5", "0x10", "inf", "-inf", "nan", "1 ",  " 1",  "1,5", "1m",  "\xc2\xb5"}) {
    EXPECT_EQ(parse_number(text), std::nullopt) << "'" << text << "'";
  }
  EXPECT_EQ(parse_number(std::string(400, '9')), std::nullopt) << "does not fit in a double";
  EXPECT_EQ(parse_number(std::string("1\0", 2)), std::nullopt);
}

TEST(ParseNumber, IgnoresTheLocale) {
  const char* const found = std::setlocale(LC_NUMERIC, "de_DE.UTF-8");
  EXPECT_EQ(parse_number("1.5"), 1.5);
  EXPECT_EQ(scaled(15, 1), "1.5");
  if (found != nullptr) {
    std::setlocale(LC_NUMERIC, "C");
  }
}

TEST(AppendScaled, WritesNoNeedlessZerosOrPoints) {
  EXPECT_EQ(scaled(12500, 4), "1.25");
  EXPECT_EQ(scaled(-3, 1), "-0.3");
  EXPECT_EQ(scaled(0, 5), "0");
  EXPECT_EQ(scaled(0, 0), "0");
  EXPECT_EQ(scaled(1, 9), "0.000000001");
  EXPECT_EQ(scaled(120000, 4), "12");
  EXPECT_EQ(scaled(-120000, 4), "-12");
  EXPECT_EQ(scaled(1200, 0), "1200");
  EXPECT_EQ(scaled(std::numeric_limits<std::int64_t>::max(), 0), "9223372036854775807");
  EXPECT_EQ(scaled(std::numeric_limits<std::int64_t>::min(), 9), "-9223372036.854775808");
}

TEST(AppendScaled, AppendsToWhatIsThere) {
  std::string line = "G1 X";
  append_scaled(line, 5, 1);
  EXPECT_EQ(line, "G1 X0.5");
}

TEST(ToInt, CutsTowardsZeroAndKeepsWithinWhatAnIntHolds) {
  EXPECT_EQ(to_int(2.9), 2);
  EXPECT_EQ(to_int(-2.9), -2);
  EXPECT_EQ(to_int(2147483647.0), std::numeric_limits<int>::max());
  EXPECT_EQ(to_int(2147483648.0), std::numeric_limits<int>::max());
  EXPECT_EQ(to_int(-1e300), std::numeric_limits<int>::min());
}

TEST(ToScaled, RoundsHalfAwayFromZero) {
  EXPECT_EQ(to_scaled(0.25, 1), 3);
  EXPECT_EQ(to_scaled(-0.25, 1), -3);
  EXPECT_EQ(to_scaled(1.00004, 4), 10000);
  EXPECT_EQ(to_scaled(-7.0, 0), -7);
}

TEST(PowerOfTen, IsExact) {
  double expected = 1.0;
  for (int decimals = 0; decimals <= 9; ++decimals) {
    EXPECT_EQ(power_of_ten(decimals), expected);
    expected *= 10.0;
  }
}

TEST(Numbers, SurviveTheRoundTripThroughText) {
  std::mt19937_64 random(1);
  std::uniform_int_distribution<std::int64_t> values(-50'000'000'000, 50'000'000'000);
  std::uniform_int_distribution<int> decimals(0, 9);
  for (int i = 0; i < 100'000; ++i) {
    const std::int64_t value = values(random);
    const int places = decimals(random);
    const std::string text = scaled(value, places);
    const std::optional<double> read = parse_number(text);
    ASSERT_TRUE(read.has_value()) << text;
    ASSERT_EQ(to_scaled(*read, places), value) << text;
    ASSERT_DOUBLE_EQ(*read, static_cast<double>(value) / power_of_ten(places)) << text;
  }
}

TEST(Readable, HasFiveDigitsAndAllBeforeThePoint) {
  EXPECT_EQ(readable(583.3333333333334), "583.33");
  EXPECT_EQ(readable(27239.12345), "27239");
  EXPECT_EQ(readable(1234567.8), "1234568");
  EXPECT_EQ(readable(1e6), "1000000");
  EXPECT_EQ(readable(-0.23611111), "-0.23611");
  EXPECT_EQ(readable(0.25), "0.25");
  EXPECT_EQ(readable(0.000123456), "0.00012346");
  EXPECT_EQ(readable(-0.0), "0");
  EXPECT_EQ(readable(9.9999999), "10");
  EXPECT_EQ(readable(1.5e-7), "1.5e-07");
  EXPECT_EQ(readable(2e12), "2e+12");
}

}  // namespace
}  // namespace unflex
