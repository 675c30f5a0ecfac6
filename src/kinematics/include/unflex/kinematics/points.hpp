// Measured places as a table.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/kinematics/fit.hpp"

namespace unflex::kinematics {

struct Points {
  std::vector<Pair> pairs;
  std::vector<std::size_t> lines;  // of the file, one for each pair
};

// Reads rows of six numbers, qa,qb,qc,x,y,z, in mm. The first row may be a header, whose names may
// be in any order. Empty lines and those that begin with # count for nothing. file: for messages.
// Errors are of kind input, with the line.
[[nodiscard]] Result<Points> parse_points(std::string_view text, const std::string& file);

}  // namespace unflex::kinematics
