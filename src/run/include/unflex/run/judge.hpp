// Whether a compensated run is better than its original.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/run/piece_reader.hpp"
#include "unflex/verify/line_rate.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::run {

// The nozzle's deviation from the run, in the timing of `reference`, while the base makes the moves
// `base`. It is sampled as finely as the nozzle's ringing needs, but more coarsely than in a
// verification.
[[nodiscard]] verify::RunDeviation deviation_of(const Piece& run,
                                                const std::vector<planner::PlannedMove>& reference,
                                                const std::vector<planner::PlannedMove>& base,
                                                const dynamics::NozzleXY& nozzle,
                                                const verify::Rules& rules, double lead_in_s);

// The nozzle's deviation from the run if the run's sliced moves are carried out.
[[nodiscard]] verify::RunDeviation deviation_as_sliced(const Piece& run,
                                                       const dynamics::NozzleXY& nozzle,
                                                       const verify::Rules& rules);

// The motion around the text, if the text is a part of a run or follows kept lines without a stop.
struct InMotion {
  std::vector<gcode::Segment>
      lines_before;           // the last lines before the text; none: it begins at rest
  bool goes_on = false;       // another part follows
  bool may_be_worse = false;  // by a little, since the part must be written
  // The end of the last move that the firmware has made.
  std::optional<gcode::Position> machine_mm = std::nullopt;
};

struct Verdict {
  std::optional<std::string> objection;  // why the original moves must stand
  bool worse = false;                    // deviates more than the original moves
  dynamics::NozzleXY nozzle;             // at the end of the run, if there is no objection
  verify::LineRate rate;                 // with the run's lines counted, if there is no objection
  std::vector<planner::PlannedMove> replayed;  // the printer's plan of the text
  double wait_s = 0.0;                         // planner::wait_s() of the run
};

// A part that must be written may have errors up to kBearableTimes those of its sliced moves, or up
// to kBearable where that is more. Verification measures more finely than judge(), so its bounds,
// kLeeway, are a little wider.
inline constexpr double kBearableTimes = 2.0;
inline constexpr double kBearableRms_mm = 5e-3;
inline constexpr double kBearable_mm = 25e-3;
inline constexpr double kLeewayTimes = 2.2;
inline constexpr double kLeewayRms_mm = kBearableRms_mm;
inline constexpr double kLeeway_mm = 30e-3;

// The beginning of an objection that names no broken limit.
inline constexpr std::string_view kWorse = "compensation would be worse: ";

// Replays the text of a compensated run as the printer would, in the state the printer is in before
// the run. Objects if the run breaks a hard rule, has more lines per second than allowed, or
// deviates more than its original moves (`before`). rate: has counted the lines before the run.
[[nodiscard]] Verdict judge(const Piece& run, const std::vector<planner::PlannedMove>& reference,
                            const verify::RunDeviation& before, std::string_view text,
                            gcode::Interpreter printer, const planner::Limits& printer_limits,
                            const dynamics::NozzleXY& nozzle, const verify::Rules& rules,
                            double lead_in_s, verify::LineRate rate, double max_lines_per_s,
                            const InMotion& in_motion);

}  // namespace unflex::run
