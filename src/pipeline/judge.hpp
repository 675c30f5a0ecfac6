// Whether a compensated run is better than its original.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/line_rate.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::pipeline {

// How the nozzle strays while the base makes the moves `base`; of the reference's own moves, how it
// would without compensation. Sampled as finely as its ringing asks for, not as a verification is.
[[nodiscard]] verify::RunDeviation deviation_of(const std::vector<planner::PlannedMove>& reference,
                                                const std::vector<planner::PlannedMove>& base,
                                                const dynamics::NozzleXY& nozzle,
                                                const verify::Rules& rules, double lead_in_s);

struct Verdict {
  std::optional<std::string> objection;        // why the original moves must stand
  dynamics::NozzleXY nozzle;                   // without objection: after the run …
  verify::LineRate rate;                       // … its lines counted …
  std::vector<planner::PlannedMove> replayed;  // … and what the printer makes of them
};

// Replays the text of a compensated run as the printer would, in the state the printer is in before
// it. Objects where it breaks a hard rule, asks for more lines per second than allowed, or where
// its deviation is larger than that of the original moves, `before`. rate: of the lines before it.
[[nodiscard]] Verdict judge(const std::vector<planner::PlannedMove>& original,
                            const verify::RunDeviation& before, std::string_view text,
                            gcode::Interpreter printer, const planner::Limits& printer_limits,
                            const dynamics::NozzleXY& nozzle, const verify::Rules& rules,
                            verify::LineRate rate, double max_lines_per_s);

}  // namespace unflex::pipeline
