// Records of resonances in a folder, by machine and axis.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/identify/record.hpp"

namespace unflex::app {

struct MachineRecords {
  std::string name;
  std::array<std::vector<identify::DataSet>, 2> axes;  // X, Y; in the order of their names
};

// A machine's records are in a folder of its own, or begin with its name:
// "ender3_resonances_x_1.csv". Files that are not called .csv or .stdata are passed by. Errors are
// of kind input: a folder that cannot be read, a file that is no record, or no machine with records
// of both axes.
[[nodiscard]] Result<std::vector<MachineRecords>> read_machines(const std::string& folder);

}  // namespace unflex::app
