// The stretches of a window in which limits count. The base without limits breaks them in a few
// places, mostly at corners, so rows bound it only near these places. After each solution the
// limits are checked again, since a base that must do less there may do more beside it.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "axis_chain.hpp"

namespace unflex::compensate {

struct NodeRange {
  std::size_t first = 0;
  std::size_t last = 0;  // included

  bool operator==(const NodeRange&) const = default;
};

// In order, and apart from each other.
using Stretches = std::vector<NodeRange>;

// Finds the nodes outside all stretches at which a value of a kind is out of its bounds. Adds all
// nodes up to `reach` away from them. Returns whether any was found.
bool add_broken(const PerKind<const double*>& values,
                const PerKind<std::optional<RowBounds>>& bounds, std::size_t nodes,
                std::size_t reach, Stretches& stretches);

// The bounds that are left if none counts outside the stretches.
[[nodiscard]] PerKind<std::optional<RowBounds>> bounds_within(
    const PerKind<std::optional<RowBounds>>& bounds, std::size_t nodes, const Stretches& stretches);

}  // namespace unflex::compensate
