// The path of a run as legs, and the sections of it that can be timed by themselves.
//
// Where the nozzle moves evenly at F for long, nothing is left to choose, and the motion before
// does not affect the motion after. So a run is cut there, and where it rests.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "unflex/compensate/run.hpp"
#include "unflex/core/foot.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/planner/planner.hpp"
#include "unflex/timing/timing.hpp"

namespace unflex::timing {

// A straight part of the path, in X and Y: one move, several that hardly differ from one, or a part
// of them.
struct Leg {
  planner::PlannedMove move;  // in the timing of a first plan
  double feed_mm_s = 0.0;     // F
  double tolerance_mm = 0.0;
  double bulge_mm = 0.0;  // how far the moves that it stands for are from it
  bool lays_filament = false;
  double entry_mm_s = planner::kNoLimit;  // largest speed at its beginning
  // How far along the path, in X and Y alone, it begins and ends.
  double from_mm = 0.0;
  double to_mm = 0.0;
};

// The place on a line that is nearest to place_mm: how far along the line it is, and how far from
// place_mm.
[[nodiscard]] inline double along_mm(const planner::PlannedMove& line, const XY& place_mm) {
  return foot_on(place_mm - xy_of(line.segment.start_mm), xy_of(line.direction), line.length_mm)
      .along_mm;
}
[[nodiscard]] inline double distance_mm(const planner::PlannedMove& line, const XY& place_mm) {
  return length(place_mm - xy_of(line.segment.start_mm) -
                along_mm(line, place_mm) * xy_of(line.direction));
}

// Whether F is the same, apart from rounding and from what a slight slope takes from it.
[[nodiscard]] bool have_same_feed(const Leg& a, const Leg& b);

// Legs between two calm places.
struct Section {
  std::vector<Leg> legs;
  // Whether the nozzle moves evenly at the beginning and at the end. Otherwise it rests there.
  bool starts_even = false;
  bool ends_even = false;
  // The nozzle's swing at the beginning, if there is one, while the base rests.
  std::optional<dynamics::NozzleMotionXY> nozzle;
  // The nozzles of SectionRules::edges at the beginning. Empty: they are where they would be
  // without an earlier motion.
  std::vector<dynamics::NozzleXY> edge_nozzles;
  // How far the nozzles at the edges may swing after the section. Unset: another section follows.
  std::optional<double> swing_tolerance_mm;
};

// What comes after a section: even motion or rest, for some time.
struct Pause {
  double duration_s = 0.0;
  XY velocity_mm_s;
};

struct SectionedPart {
  Section section;  // without legs where a run begins with a pause
  Pause pause;
};

// Whether the move has no length in X and Y. The base rests meanwhile.
[[nodiscard]] bool is_upright(const planner::PlannedMove& move);

// An upright move within its bounds.
[[nodiscard]] planner::PlannedMove from_rest_to_rest(const planner::PlannedMove& move,
                                                     const MoveBounds& bounds);

// How the search for a motion begins, and how far it may go.
struct FirstPlan {
  double accel_share = 0.5;                          // of the base's acceleration
  double travel_tolerance_mm = kTravelTolerance_mm;  // at most kTravelTolerance_mm
};

// The path in sections. settling_s: how long before and after it even motion is settled. nullopt:
// there are limits of acceleration along the path, which sections do not know.
[[nodiscard]] std::optional<std::vector<SectionedPart>> sections(
    std::span<const planner::PlannedMove> path, std::span<const MoveBounds> bounds,
    const compensate::Setup& setup, double settling_s, const FirstPlan& first = {});

}  // namespace unflex::timing
