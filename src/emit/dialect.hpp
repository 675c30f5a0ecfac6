// What a firmware is told in its own words.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/firmware.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::emit {

// As its makers write it.
[[nodiscard]] std::string_view brand(Firmware firmware);

// The lines, without their endings, that put `wanted` in force: what differs from `current`, or
// everything unless it is `known`.
[[nodiscard]] std::vector<std::string> limit_lines(const planner::FirmwareConfig& config,
                                                   const planner::Limits& wanted,
                                                   const planner::Limits& current, bool known);

}  // namespace unflex::emit
