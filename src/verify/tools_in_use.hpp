// Which nozzles hang on the machine while each of its tools is in use.
#pragma once

#include <optional>
#include <vector>

#include "unflex/verify/verify.hpp"

namespace unflex::verify {

class ToolsInUse {
 public:
  ToolsInUse(const Rules& rules, const Observation& observation);

  // The reach of the slowest tool, s; 0 if the rules tell of no tools.
  [[nodiscard]] double longest_reach_s() const { return longest_reach_s_; }
  // Takes a tool. Returns whether other nozzles hang on the machine from now on. Then `rules` get
  // the nozzle and the changes of the tool.
  [[nodiscard]] bool take(int tool, Rules& rules);
  // The nozzles of the tool that was taken: that of the rules, then those of the observation.
  [[nodiscard]] const std::vector<NozzleModel>& nozzles() const { return hung_[present_].nozzles; }

 private:
  struct Hung {
    int number = -1;
    std::vector<NozzleModel> nozzles;
    MachineChange change;
  };

  std::vector<Hung> hung_;  // the printer's own first
  std::size_t present_ = 0;
  double longest_reach_s_ = 0.0;
};

}  // namespace unflex::verify
