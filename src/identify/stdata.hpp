// Shake&Tune's own format (shaketune/helpers/accelerometer.py): one line of JSON for each
// measurement, {"name": "axis_X_20241001_120000", "samples": [[time, x, y, z], …]}, all packed by
// Zstandard.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/identify/record.hpp"

namespace unflex::identify {

[[nodiscard]] bool is_stdata(std::string_view bytes);

// Errors are those of parse_records().
[[nodiscard]] Result<std::vector<DataSet>> parse_stdata(std::string_view bytes,
                                                        const std::string& file);

}  // namespace unflex::identify
