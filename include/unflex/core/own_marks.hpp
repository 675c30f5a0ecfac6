// The comment lines by which unflex knows what it has written.
#pragma once

#include <string_view>

namespace unflex {

// Begins every comment line that unflex writes.
inline constexpr std::string_view kOwnMark = ";unflex";
// Stands before the first line and behind the last line of each compensated run.
inline constexpr std::string_view kRunMark = ";unflex run";
inline constexpr std::string_view kRunEndMark = ";unflex end";

}  // namespace unflex
