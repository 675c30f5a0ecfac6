#include "stretches.hpp"

#include <algorithm>

namespace unflex::compensate {
namespace {

// An excess up to this share of the bounds' width is rounding.
constexpr double kRounding = 1e-9;

// Bounds that no value comes near, and yet not so far that sums with them lose digits.
Interval far_out(const Interval& bounds) {
  constexpr double kTimes = 100.0;
  const double far = kTimes * (bounds.upper - bounds.lower);
  return {bounds.lower - far, bounds.upper + far};
}

bool is_out(double value, const Interval& bounds) {
  const double slack = kRounding * std::min(bounds.upper - bounds.lower, 1e6);
  return value < bounds.lower - slack || value > bounds.upper + slack;
}

}  // namespace

bool add_broken(const PerKind<const double*>& values,
                const PerKind<std::optional<RowBounds>>& bounds, std::size_t nodes,
                std::size_t reach, Stretches& stretches) {
  std::vector<char> counts(nodes, 0);
  for (const NodeRange& range : stretches) {
    std::fill(counts.begin() + static_cast<std::ptrdiff_t>(range.first),
              counts.begin() + static_cast<std::ptrdiff_t>(range.last) + 1, 1);
  }
  std::vector<NodeRange> added;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    const std::size_t count = bounds[i] ? row_count(kRowKinds[i], nodes) : 0;
    for (std::size_t k = 0; k < count; ++k) {
      if (counts[k] == 0 && is_out(values[i][k], bounds[i]->at(k, nodes))) {
        added.push_back({k - std::min(k, reach), std::min(k + reach, nodes - 1)});
      }
    }
  }
  if (added.empty()) {
    return false;
  }
  added.insert(added.end(), stretches.begin(), stretches.end());
  std::ranges::sort(added, {}, &NodeRange::first);
  stretches.clear();
  for (const NodeRange& range : added) {
    if (!stretches.empty() && range.first <= stretches.back().last + 1) {
      stretches.back().last = std::max(stretches.back().last, range.last);
    } else {
      stretches.push_back(range);
    }
  }
  return true;
}

PerKind<std::optional<RowBounds>> bounds_within(const PerKind<std::optional<RowBounds>>& bounds,
                                                std::size_t nodes, const Stretches& stretches) {
  PerKind<std::optional<RowBounds>> result = bounds;
  for (std::size_t i = 0; i < bounds.size(); ++i) {
    if (!bounds[i]) {
      continue;
    }
    const std::size_t count = row_count(kRowKinds[i], nodes);
    std::vector<Interval>& each = result[i]->each;
    each.assign(count, far_out(bounds[i]->inner));
    for (const NodeRange& range : stretches) {
      for (std::size_t k = range.first; k <= std::min(range.last, count - 1); ++k) {
        each[k] = bounds[i]->at(k, nodes);
      }
    }
  }
  return result;
}

}  // namespace unflex::compensate
