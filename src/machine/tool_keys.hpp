// The keys of a tool changer's tools: tool.0.dynamics.x.freq_hz and so on.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "assign.hpp"
#include "draft.hpp"

namespace unflex::machine {

// Whether the name begins as a tool's section or key does: "tool" and what is behind "tool.".
[[nodiscard]] bool is_of_tool(std::string_view name);

// Whether keys start with "name.".
[[nodiscard]] bool is_tool_section(std::string_view name);

// Begins the section of a tool, or one within it. Returns what is wrong with its name, or an empty
// text.
[[nodiscard]] std::string open_tool_section(const std::string& name, Draft& draft);

// As assign(), for the key of a tool.
[[nodiscard]] std::string assign_to_tool(const std::string& name, const Value& value,
                                         const SourcePlace& place, Draft& draft);

// Checks the printer with each of its tools.
[[nodiscard]] Status check_tools(const Draft& draft);

// The keys that a tool gives, in the order of the documentation. The value is as TOML writes it.
struct ToolRow {
  std::string key;
  std::string value;
};
[[nodiscard]] std::vector<ToolRow> rows_of(const ToolSettings& tool);

// Whether tools tell the frequency of an axis, 0 or 1, whatever the printer's own is: each does,
// and tool 0, with which a print begins, is among them.
[[nodiscard]] bool tell_frequency(const std::vector<ToolSettings>& tools, std::size_t axis);

}  // namespace unflex::machine
