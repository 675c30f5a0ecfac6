// Numbers and curves in the text that commands print.
#pragma once

#include <string>
#include <vector>

namespace unflex::app {

// The value with digits down to a tenth of an interval's width; more would tell nothing.
[[nodiscard]] std::string number_text(double value, double width);

// A line of at most 64 blocks, whose heights are means of the values, from `least` to `most`.
[[nodiscard]] std::string sparkline(const std::vector<double>& values, double least, double most);

}  // namespace unflex::app
