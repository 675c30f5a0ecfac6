// Histogram over cells whose borders are 1 % apart, from 1e-9 to 1e2; what lies outside falls into
// the first or last cell.
#pragma once

#include <cstddef>
#include <vector>

namespace unflex::verify {

// Adds `weight` to the cell of `value`; an empty histogram gets its cells.
void add_to_histogram(std::vector<double>& histogram, double value, double weight);

// The middle of the cell in which the given fraction of the whole weight is reached, within 0.5 %;
// 0 for an empty histogram.
[[nodiscard]] double histogram_quantile(const std::vector<double>& histogram, double fraction);

}  // namespace unflex::verify
