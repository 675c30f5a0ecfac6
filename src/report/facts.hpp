// The page's list of facts: how the work went and figures that no picture shows.
#pragma once

#include <cstddef>

#include "unflex/report/json_parts.hpp"
#include "unflex/report/report.hpp"

namespace unflex::report {

// The most entries of a list on the page, and the most bytes of a text in it.
inline constexpr std::size_t kMostListed = 100;
inline constexpr std::size_t kLongestText = 500;

// Pairs of a name and a value, in the order in which they are shown.
[[nodiscard]] Json facts_json(const Report& r);

}  // namespace unflex::report
