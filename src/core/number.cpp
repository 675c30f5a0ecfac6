#include "unflex/core/number.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <system_error>

#include "unflex/core/math.hpp"

namespace unflex {
namespace {

constexpr std::array<std::int64_t, 10> kPowersOfTen = {
    1, 10, 100, 1'000, 10'000, 100'000, 1'000'000, 10'000'000, 100'000'000, 1'000'000'000};

// Plain decimals of few digits: a double holds both their digits as an integer and the power of ten
// that divides it, so one division rounds correctly (Clinger, How to Read Floating Point Numbers
// Accurately, 1990). All other texts are left to from_chars.
constexpr int kExactDigits = 15;
constexpr std::array<double, kExactDigits + 1> kExactPowersOfTen = {
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};

bool parse_short(std::string_view text, double& value) {
  const bool negative = !text.empty() && text.front() == '-';
  text.remove_prefix(negative ? 1 : 0);
  if (text.size() > kExactDigits) {
    return false;
  }
  std::int64_t digits = 0;
  std::size_t point = text.size();
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] >= '0' && text[i] <= '9') {
      digits = 10 * digits + (text[i] - '0');
    } else if (text[i] == '.' && point == text.size()) {
      point = i;
    } else {
      return false;
    }
  }
  const std::size_t decimals = point == text.size() ? 0 : text.size() - point - 1;
  if (text.size() == (point == text.size() ? 0U : 1U)) {
    return false;  // no digit
  }
  const double magnitude = static_cast<double>(digits) / kExactPowersOfTen[decimals];
  value = negative ? -magnitude : magnitude;
  return true;
}

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
  double value = 0.0;
  if (parse_short(text, value)) {
    return value;
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
  const char* const end = text.data() + text.size();
  const auto [stop, failure] = std::from_chars(text.data(), end, value, std::chars_format::fixed);
  if (failure != std::errc{} || stop != end || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

void append_scaled(std::string& out, std::int64_t scaled, int decimals) {
  std::array<char, 24> digits{};
  const bool negative = scaled < 0;
  // Negating in unsigned arithmetic keeps the smallest int64 defined.
  auto magnitude =
      negative ? 0U - static_cast<std::uint64_t>(scaled) : static_cast<std::uint64_t>(scaled);
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

std::optional<double> parse_real(std::string_view text) {
  if (text.starts_with('+')) {
    text.remove_prefix(1);
  }
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool is_whole = error == std::errc{} && end == text.data() + text.size();
  return is_whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

int to_int(double value) {
  using Limits = std::numeric_limits<int>;
  return static_cast<int>(std::clamp<double>(value, Limits::min(), Limits::max()));
}

std::int64_t to_scaled(double value, int decimals) {
  return std::llround(value * power_of_ten(decimals));
}

double power_of_ten(int decimals) {
  return static_cast<double>(kPowersOfTen[static_cast<std::size_t>(decimals)]);
}

std::string readable(double value) {
  constexpr int kDigits = 5;
  constexpr int kMostDecimals = 9;
  constexpr double kLeast = 1e-4;
  constexpr double kMost = 1e9;  // so that it fits the integers of to_scaled()
  const double size = std::abs(value);
  if (!(size < kMost) || (size > 0.0 && size < kLeast)) {
    return fmt::format("{:.{}g}", value, kDigits);
  }
  const int before = size > 0.0 ? to_int(std::floor(math::log10(size))) + 1 : 1;
  const int decimals = std::clamp(kDigits - before, 0, kMostDecimals);
  std::string text;
  append_scaled(text, to_scaled(value, decimals), decimals);
  return text;
}

}  // namespace unflex
