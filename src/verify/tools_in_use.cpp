#include "tools_in_use.hpp"

#include <algorithm>

#include "unflex/verify/near_path.hpp"

namespace unflex::verify {
namespace {

std::vector<NozzleModel> with(const NozzleModel& first, const std::vector<NozzleModel>& others) {
  std::vector<NozzleModel> all = {first};
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

}  // namespace

ToolsInUse::ToolsInUse(const Rules& rules, const Observation& observation) {
  hung_.push_back({-1, with(rules.nozzle, observation.detuned), rules.change});
  for (std::size_t i = 0; i < rules.tools.size(); ++i) {
    const ToolModel& tool = rules.tools[i];
    const bool is_told = i < observation.detuned_by_tool.size();
    hung_.push_back(
        {tool.number,
         with(tool.nozzle, is_told ? observation.detuned_by_tool[i] : observation.detuned),
         tool.change});
    longest_reach_s_ = std::max(longest_reach_s_, reach_s(tool.nozzle));
  }
}

bool ToolsInUse::take(int tool, Rules& rules) {
  const auto found = std::ranges::find(hung_, tool, &Hung::number);
  const auto next = found == hung_.end() ? 0 : static_cast<std::size_t>(found - hung_.begin());
  if (next == present_) {
    return false;
  }
  present_ = next;
  rules.nozzle = hung_[next].nozzles.front();
  rules.change = hung_[next].change;
  return true;
}

}  // namespace unflex::verify
