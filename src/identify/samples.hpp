// Rows of a file as the samples of an accelerometer.
#pragma once

#include <string>
#include <vector>

#include "unflex/identify/record.hpp"

namespace unflex::identify {

using Row = std::vector<double>;

// A data set with the axis that its name tells, without data.
[[nodiscard]] DataSet named_set(std::string name);

// Rows of (time or number, x, y, z).
[[nodiscard]] Recording recording_of(const std::vector<Row>& rows, double rate_hz);

// Rows of (time in s, x, y, z); notes missing samples. The error, of kind input, is that times do
// not grow.
[[nodiscard]] Result<DataSet> timed_set(const std::string& name, const std::vector<Row>& rows);

}  // namespace unflex::identify
