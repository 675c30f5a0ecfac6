// The parts that every report of the program shares.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "unflex/report/report.hpp"

namespace unflex::report {

using Json = nlohmann::ordered_json;

inline constexpr int kSchemaVersion = 1;

// {"limits.max_accel_mm_s2": {"value": 5000, "origin": "printer.toml:7"}, …}
[[nodiscard]] Json settings_json(const std::vector<Setting>& settings);

// Two spaces of indentation, final newline. What is not UTF-8 (file names are bytes) is replaced.
[[nodiscard]] std::string dump(const Json& json);

// Three figures, so that 1234 µm and 0.05 µm fit the same column; without the unit.
[[nodiscard]] std::string micrometres_text(double mm);

// 0.9876 → "98.7 %", and "100.0 %" only of all there is.
[[nodiscard]] std::string share_text(double share);

// {"total_mm": …, "compensated_share": …, …}
[[nodiscard]] Json path_json(const ExtrudedPath& path);

// [{"command": "M1234", "count": 3, …}, …]
[[nodiscard]] Json unknown_json(const std::vector<UnknownCommand>& commands);
// … and as lines of a summary, the first few.
[[nodiscard]] std::string unknown_text(const std::vector<UnknownCommand>& commands);

// 3725.4 → "1h 02m 05s"; below a minute with tenths, "5.3s".
[[nodiscard]] std::string duration_text(double seconds);

}  // namespace unflex::report
