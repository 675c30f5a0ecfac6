// The parts of JSON that every report of the program shares.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "unflex/report/report.hpp"

namespace unflex::report {

using Json = nlohmann::ordered_json;

inline constexpr int kSchemaVersion = 1;

// {"limits.max_accel_mm_s2": {"value": 5000, "origin": "printer.toml:7"}, …}
[[nodiscard]] Json settings_json(const std::vector<Setting>& settings);

// Two spaces of indentation, final newline. Bytes that are not UTF-8, which file names may have,
// are replaced.
[[nodiscard]] std::string dump(const Json& json);

// {"total_mm": …, "compensated_share": …, …}
[[nodiscard]] Json path_json(const ExtrudedPath& path);

// [{"command": "M1234", "count": 3, …}, …]
[[nodiscard]] Json unknown_json(const std::vector<UnknownCommand>& commands);

// {"motors": [{"motor": "X", "sliced_hz": …}], "total": …, "max_hz": …}; null where no steps per mm
// are known. has_output: whether there are emitted lines.
[[nodiscard]] Json step_rates_json(const StepRates& rates, bool has_output);

// {"band_c": 5, "sliced": {"colder_s": …}, …}; null without a model of the hotend.
[[nodiscard]] Json temperature_json(const std::optional<Temperature>& temperature);

}  // namespace unflex::report
