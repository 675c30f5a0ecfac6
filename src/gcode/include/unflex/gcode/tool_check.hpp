// Whether the printer file tells of the tools that a print selects.
#pragma once

#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/gcode/interpreter.hpp"

namespace unflex::gcode {

// An error of kind input, at the line in `file`, if the event selects a tool that is not among
// `tools`. Any tool may be selected if there are none.
[[nodiscard]] Status check_tool(const Event& event, const std::vector<int>& tools,
                                const std::string& file);

}  // namespace unflex::gcode
