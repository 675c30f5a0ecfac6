// Tables of test data.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <fstream>
#include <string>
#include <vector>

#include "paths.hpp"
#include "unflex/core/number.hpp"

namespace unflex::planner::testing {

using Row = std::vector<std::string>;

inline std::vector<Row> rows(const std::string& name) {
  std::ifstream file(std::string(test_paths::kData) + "/" + name);
  std::vector<Row> result;
  for (std::string line; std::getline(file, line);) {
    Row& row = result.emplace_back();
    for (std::size_t begin = 0; begin <= line.size();) {
      const std::size_t end = std::min(line.find(',', begin), line.size());
      row.push_back(line.substr(begin, end - begin));
      begin = end + 1;
    }
  }
  return result;
}

inline double number(const Row& row, std::size_t column) {
  return parse_number(row.at(column)).value();
}

// Columns 1 to 4: X Y Z E.
inline std::array<double, 4> axes(const Row& row) {
  return {number(row, 1), number(row, 2), number(row, 3), number(row, 4)};
}

}  // namespace unflex::planner::testing
