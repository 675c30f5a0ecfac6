#include "unflex/planner/plan_times.hpp"

#include <algorithm>

namespace unflex::planner {

std::vector<double> starts_s(std::span<const PlannedMove> moves, double first_s) {
  std::vector<double> starts = {first_s};
  starts.reserve(moves.size() + 1);
  for (const PlannedMove& move : moves) {
    starts.push_back(starts.back() + move.duration_s());
  }
  return starts;
}

std::size_t move_at(std::span<const double> starts_s, double t) {
  const auto after = std::upper_bound(starts_s.begin(), starts_s.end() - 1, t);
  return after == starts_s.begin() ? 0 : static_cast<std::size_t>(after - starts_s.begin()) - 1;
}

}  // namespace unflex::planner
