// Numbers in and out of text, independent of the locale.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace unflex {

// Reads the whole of `text` as a decimal number as printers and slicers write it: "1", "+1", ".5",
// "-.8", "3.". Exponents, "inf", "nan", hexadecimal, and anything left over give nullopt.
[[nodiscard]] std::optional<double> parse_number(std::string_view text);

// Reads the whole of `text` as a finite number as programs write it, with an exponent or without.
[[nodiscard]] std::optional<double> parse_real(std::string_view text);

// Rounds towards zero. A value that no int can hold becomes the nearest int. value must not be NaN.
[[nodiscard]] int to_int(double value);

// Appends `scaled / 10^decimals` without trailing zeros or a needless point: (12500, 4) is "1.25",
// (-3, 1) is "-0.3", (0, 5) is "0". There is no "-0".
void append_scaled(std::string& out, std::int64_t scaled, int decimals);

// Rounds half away from zero to an integer multiple of 10^-decimals, for append_scaled.
// decimals in [0, 9]; |value| * 10^decimals must fit in an int64.
[[nodiscard]] std::int64_t to_scaled(double value, int decimals);

// Text for people, with five digits. Larger numbers keep all digits before the point. An exponent
// is used only from 1e9 on and below 1e-4. 583.3333 is "583.33", 27239.1 is "27239", 0.25 is
// "0.25".
[[nodiscard]] std::string readable(double value);

// 10^decimals, decimals in [0, 9].
[[nodiscard]] double power_of_ten(int decimals);

}  // namespace unflex
