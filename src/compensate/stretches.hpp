// The stretches of a window in which limits count. The base without limits breaks them in a few
// places, mostly at corners, so rows bound it near those alone. Whoever has solved that asks again,
// since a base that must do less there may do more beside it.
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

// Adds all nodes up to `reach` away from one whose value of a kind is out of its bounds and that no
// stretch has yet. Returns whether there is one.
bool add_broken(const PerKind<const double*>& values,
                const PerKind<std::optional<RowBounds>>& bounds, std::size_t nodes,
                std::size_t reach, Stretches& stretches);

// The bounds that are left if none counts outside the stretches.
[[nodiscard]] PerKind<std::optional<RowBounds>> bounds_within(
    const PerKind<std::optional<RowBounds>>& bounds, std::size_t nodes, const Stretches& stretches);

}  // namespace unflex::compensate
