// Character classes of G-code; ASCII whatever the locale.
#pragma once

#include "unflex/core/text.hpp"

namespace unflex::gcode {

constexpr bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f' || c == '\n';
}

constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

constexpr bool is_lower(char c) { return c >= 'a' && c <= 'z'; }

constexpr char to_upper(char c) { return is_lower(c) ? static_cast<char>(c - 'a' + 'A') : c; }

constexpr bool is_letter(char c) { return to_upper(c) >= 'A' && to_upper(c) <= 'Z'; }

constexpr bool is_name_character(char c) { return is_letter(c) || is_digit(c) || c == '_'; }

}  // namespace unflex::gcode
