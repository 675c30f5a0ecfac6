// Marks that unflex writes besides motion: the comment lines by which it knows its own output, and
// the names of its Klipper macros (docs/pausing.md).
#pragma once

#include <string_view>

namespace unflex {

// Begins every comment line that unflex writes, but for kFilamentMark and
// kJointsMark.
inline constexpr std::string_view kOwnMark = ";unflex";
// Stands before the first line and behind the last line of each compensated run. If the base moves
// before the plan does, kLeadInWord and a time in s follow the first. If the run need not last as
// long as sliced, kFreeTimingWord ends it.
inline constexpr std::string_view kRunMark = ";unflex run";
inline constexpr std::string_view kLeadInWord = " LEAD_IN=";
inline constexpr std::string_view kFreeTimingWord = " TIMING=free";
inline constexpr std::string_view kRunEndMark = ";unflex end";

// Begins the last line of a print that was fitted to its filament. It does not begin with kOwnMark,
// since such a print may still be compensated.
inline constexpr std::string_view kFilamentMark = "; unflex filament:";

// Begins the last line of a print whose X, Y and Z are joints. Such a print is not translated
// again.
inline constexpr std::string_view kJointsMark = "; unflex joints:";

// The macro that a run calls where it begins and where it has ended.
inline constexpr std::string_view kCheckpointMacro = "UNFLEX_CHECKPOINT";
// The macro that sets limits in the middle of a run: SET_VELOCITY_LIMIT, unless the run has been
// interrupted.
inline constexpr std::string_view kLimitsMacro = "UNFLEX_LIMITS";

}  // namespace unflex
