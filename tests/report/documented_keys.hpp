// The keys of a JSON report as docs/report.md writes them.
#pragma once

#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

namespace unflex::report {

// "deviation.*.*.contour_max_mm": `*` stands for names that are not fixed or that repeat.
inline void collect_keys(const nlohmann::json& node, const std::string& path,
                         std::set<std::string>& keys) {
  if (node.is_array() && !node.empty() && node.front().is_object()) {
    collect_keys(node.front(), path + "[]", keys);
    return;
  }
  if (!node.is_object()) {
    keys.insert(path);
    return;
  }
  const std::set<std::string> open = {
      "deviation", "deviation.*",     "printer",  "kept_moves",   "extruded_path.kept_mm",
      "commands",  "limits_in_print", "dynamics", "answers.worst"};
  for (const auto& [name, value] : node.items()) {
    const std::string part = open.contains(path) ? "*" : name;
    collect_keys(value, path.empty() ? part : path + "." + part, keys);
  }
}

// The names in backquotes in the first column of the tables between two headings.
inline std::set<std::string> documented_keys(const std::string& file, const std::string& heading) {
  std::ifstream page(file);
  std::set<std::string> keys;
  bool inside = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) {
      inside = line == "## " + heading;
    }
    if (!inside || !line.starts_with("| `")) {
      continue;
    }
    const std::string column = line.substr(0, line.find(" | "));
    for (std::size_t open = column.find('`'); open != std::string::npos;) {
      const std::size_t close = column.find('`', open + 1);
      keys.insert(column.substr(open + 1, close - open - 1));
      open = column.find('`', close + 1);
    }
  }
  return keys;
}

}  // namespace unflex::report
