#include "unflex/gcode/tool_check.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace unflex::gcode {

Status check_tool(const Event& event, const std::vector<int>& tools, const std::string& file) {
  if (!event.tool || tools.empty() || std::ranges::find(tools, *event.tool) != tools.end()) {
    return {};
  }
  return fail(ErrorKind::input, {file, event.line.number},
              fmt::format("tool {} is selected, but the printer file has no [tool.{}]; add it, "
                          "empty if the tool swings as the printer itself",
                          *event.tool, *event.tool));
}

}  // namespace unflex::gcode
