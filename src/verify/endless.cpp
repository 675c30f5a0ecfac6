#include "unflex/verify/endless.hpp"

#include <fmt/core.h>

#include <algorithm>

namespace unflex::verify {
namespace {

constexpr double kHour_s = 3600.0;

}  // namespace

bool is_endless(const planner::PlannedMove& move) { return !(move.duration_s() <= kHour_s); }

const planner::PlannedMove* endless(const std::vector<planner::PlannedMove>& moves) {
  const auto found = std::ranges::find_if(moves, is_endless);
  return found == moves.end() ? nullptr : &*found;
}

Error endless_move(const planner::PlannedMove& move, const std::string& file) {
  return {ErrorKind::input,
          {file, move.segment.line},
          fmt::format("this move would take {:.3g} hours; check its length, its F and the limits",
                      move.duration_s() / kHour_s)};
}

}  // namespace unflex::verify
