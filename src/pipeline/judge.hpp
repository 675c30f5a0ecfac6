// Whether a compensated run is better than its original.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "piece_reader.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/verify/line_rate.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::pipeline {

// How the nozzle strays from the run while the base makes the moves `base`; of the run's own moves,
// how it would without compensation. Sampled as finely as its ringing asks for, not as a
// verification is.
[[nodiscard]] verify::RunDeviation deviation_of(const Piece& run,
                                                const std::vector<planner::PlannedMove>& base,
                                                const dynamics::NozzleXY& nozzle,
                                                const verify::Rules& rules, double lead_in_s);

// Where the text is a part of a run, or the printer passes into it from lines that are kept.
struct InMotion {
  std::vector<gcode::Segment> lines_before;  // the last ones of what is before; none: from rest
  bool goes_on = false;                      // another part follows
  bool may_be_worse = false;                 // by little: there is no other way left
  // Where the last move led that the firmware has made.
  std::optional<gcode::Position> machine_mm = std::nullopt;
};

struct Verdict {
  std::optional<std::string> objection;        // why the original moves must stand
  bool worse = false;                          // than they, which was allowed
  dynamics::NozzleXY nozzle;                   // without objection: after the run …
  verify::LineRate rate;                       // … its lines counted …
  std::vector<planner::PlannedMove> replayed;  // … and what the printer makes of them
};

// Replays the text of a compensated run as the printer would, in the state the printer is in before
// it. Objects where it breaks a hard rule, asks for more lines per second than allowed, or where
// its deviation is larger than that of the original moves, `before`. rate: of the lines before it.
[[nodiscard]] Verdict judge(const Piece& run, const verify::RunDeviation& before,
                            std::string_view text, gcode::Interpreter printer,
                            const planner::Limits& printer_limits, const dynamics::NozzleXY& nozzle,
                            const verify::Rules& rules, double lead_in_s, verify::LineRate rate,
                            double max_lines_per_s, const InMotion& in_motion);

}  // namespace unflex::pipeline
