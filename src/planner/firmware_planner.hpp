// How each firmware plans, as a table of functions. The tables are in src/firmware.
#pragma once

#include <memory>

#include "unflex/core/firmware_tables.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::planner {

struct FirmwarePlanner {
  std::unique_ptr<Planner> (*make)(const Limits& limits, const FirmwareConfig& config);
  Limits (*as_accepted)(Limits limits);  // see planner::as_accepted()
};

}  // namespace unflex::planner

namespace unflex {
UNFLEX_FIRMWARE_TABLES(planner::FirmwarePlanner, kPlanner)
}
