// Wording that text, page and picture of the fastest motions share.
#pragma once

#include <string>
#include <string_view>

#include "unflex/study/fastest.hpp"

namespace unflex::study {

inline constexpr std::string_view kAsSliced = "as sliced";
inline constexpr std::string_view kAtFeed = "always at F";

// "at all times"
[[nodiscard]] std::string rule_text(const ToleranceRule& rule);

// For which frequencies the contenders are made, as a sentence without a full stop.
[[nodiscard]] std::string tuning_text(const FastestOutcome& outcome);

// "6.31", from a minute on "1:43.9".
[[nodiscard]] std::string time_text(double time_s);

// "22 %"; "—" where there is nothing to compare.
[[nodiscard]] std::string saving_text(const FastestOutcome& outcome, std::size_t tolerance);

}  // namespace unflex::study
