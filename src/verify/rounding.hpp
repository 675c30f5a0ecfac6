// By how much rounding may put a value above its limit.
#pragma once

namespace unflex::verify {

// Emitted coordinates have four decimals.
inline constexpr double kRounding_mm = 1e-4;
// A limit is broken by a value that is above it by more than this share.
inline constexpr double kLimitTolerance = 1e-3;

}  // namespace unflex::verify
