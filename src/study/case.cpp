#include "unflex/study/case.hpp"

#include <array>

#include "unflex/planner/klipper_planner.hpp"

namespace unflex::study {
namespace {

constexpr double kSideMm = 10.0;
constexpr double kFilamentMm = 0.3;

constexpr std::array<Case, 11> kCases = {{
    {"ref", "", {100.0, 0.5}, 5000.0, 100.0, 5e-3},
    {"1A", "ω 50 rad/s", {50.0, 0.5}, 5000.0, 100.0, 5e-3},
    {"1B", "ω 200 rad/s", {200.0, 0.5}, 5000.0, 100.0, 5e-3},
    {"2A", "ζ 0", {100.0, 0.0}, 5000.0, 100.0, 5e-3},
    {"2B", "ζ 1", {100.0, 1.0}, 5000.0, 100.0, 5e-3},
    {"3A", "1000 mm/s²", {100.0, 0.5}, 1000.0, 100.0, 5e-3},
    {"3B", "10 000 mm/s²", {100.0, 0.5}, 10000.0, 100.0, 5e-3},
    {"4A", "50 mm/s", {100.0, 0.5}, 5000.0, 50.0, 5e-3},
    {"4B", "200 mm/s", {100.0, 0.5}, 5000.0, 200.0, 5e-3},
    {"5A", "step 10 ms", {100.0, 0.5}, 5000.0, 100.0, 10e-3},
    {"5B", "step 1 ms", {100.0, 0.5}, 5000.0, 100.0, 1e-3},
}};

}  // namespace

std::span<const Case> thesis_cases() { return kCases; }

std::vector<planner::PlannedMove> corner(const Case& of, double accel_mm_s2) {
  planner::Limits limits;
  limits.max_velocity_mm_s = of.velocity_mm_s;
  limits.max_accel_mm_s2 = accel_mm_s2;
  limits.square_corner_velocity_mm_s = 0.0;
  limits.minimum_cruise_ratio = 0.0;
  planner::KlipperPlanner planner(limits, {});
  gcode::Segment segment;
  segment.feed_mm_s = of.velocity_mm_s;
  segment.end_mm = {kSideMm, 0.0, 0.0, kFilamentMm};
  planner.add(segment);
  segment.start_mm = segment.end_mm;
  segment.end_mm = {kSideMm, kSideMm, 0.0, 2.0 * kFilamentMm};
  planner.add(segment);
  planner.stop();
  std::vector<planner::PlannedMove> moves;
  planner.take(moves);
  return moves;
}

}  // namespace unflex::study
