#include "unflex/core/number.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <system_error>

namespace unflex {
namespace {

constexpr std::array<std::int64_t, 10> kPowersOfTen = {
    1, 10, 100, 1'000, 10'000, 100'000, 1'000'000, 10'000'000, 100'000'000, 1'000'000'000};

}  // namespace

std::optional<double> parse_number(std::string_view text) {
  // from_chars takes "-" but not "+"; in fixed format it stops before an exponent, which the
  // check for leftovers then rejects. It would take "inf" and "nan", so look at the characters.
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
    if (!text.empty() && text.front() == '-') {
      return std::nullopt;
    }
  }
  bool any_digit = false;
  for (const char c : text) {
    any_digit = any_digit || (c >= '0' && c <= '9');
    if (!((c >= '0' && c <= '9') || c == '.' || c == '-')) {
      return std::nullopt;
    }
  }
  if (!any_digit) {
    return std::nullopt;
  }
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const auto [stop, failure] =
      std::from_chars(text.data(), end, value, std::chars_format::fixed);
  if (failure != std::errc{} || stop != end || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

void append_scaled(std::string& out, std::int64_t scaled, int decimals) {
  std::array<char, 24> digits{};
  const bool negative = scaled < 0;
  // Negating in unsigned arithmetic keeps the smallest int64 defined.
  auto magnitude = negative ? 0U - static_cast<std::uint64_t>(scaled)
                            : static_cast<std::uint64_t>(scaled);
  while (decimals > 0 && magnitude % 10 == 0) {
    magnitude /= 10;
    --decimals;
    if (magnitude == 0) {
      decimals = 0;
    }
  }
  char* cursor = digits.data() + digits.size();
  char* const end = cursor;
  for (int i = 0; i < decimals; ++i) {
    *--cursor = static_cast<char>('0' + magnitude % 10);
    magnitude /= 10;
  }
  if (decimals > 0) {
    *--cursor = '.';
  }
  do {
    *--cursor = static_cast<char>('0' + magnitude % 10);
    magnitude /= 10;
  } while (magnitude != 0);
  if (negative) {
    *--cursor = '-';
  }
  out.append(cursor, end);
}

std::int64_t to_scaled(double value, int decimals) {
  return std::llround(value * power_of_ten(decimals));
}

double power_of_ten(int decimals) {
  return static_cast<double>(kPowersOfTen[static_cast<std::size_t>(decimals)]);
}

}  // namespace unflex
