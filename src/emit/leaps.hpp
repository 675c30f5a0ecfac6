// Long straight stretches at constant speed. One line covers each of them, since a search among
// shorter lines would find nothing better.
#pragma once

#include <cstddef>
#include <vector>

#include "line_cost.hpp"
#include "step_ends.hpp"

namespace unflex::emit {

// A line from place `begin` at candidate `from` to place `end` at candidate `until`.
struct Leap {
  std::size_t from = 0;
  std::size_t until = 0;
  Place begin{};
  Place end{};
};

// The leaps between candidate 0, at place `start`, and `last`, at place `end`, in order. None lies
// across one of the `wanted` candidates. A leap begins and ends where the base comes closest to
// whole steps across its path.
[[nodiscard]] std::vector<Leap> leaps(const Candidates& costs,
                                      const std::vector<std::size_t>& wanted, const Place& start,
                                      std::size_t last, const Place& end, const StepGrid& grid,
                                      const LineRules& rules);

}  // namespace unflex::emit
