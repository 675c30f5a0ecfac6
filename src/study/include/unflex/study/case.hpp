// The cases of the source thesis (Cisalpino, UFLA 2023): a corner (0,0) → (10,0) → (10,10) with a
// full stop in it, for one printer and five changes to the printer, each in both directions.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::study {

struct Case {
  std::string_view name;     // "ref", "1A" …
  std::string_view changes;  // changes against the reference: "ω 50 rad/s"
  dynamics::FlexibleAxis axis{100.0, 0.5};
  double accel_mm_s2 = 5000.0;
  double velocity_mm_s = 100.0;
  double period_s = 5e-3;  // node period of the thesis' own methods
};

// ref 1A 1B 2A 2B 3A 3B 4A 4B 5A 5B, in the order of the thesis.
[[nodiscard]] std::span<const Case> thesis_cases();

// The corner's plan, from rest to rest, with this acceleration.
[[nodiscard]] std::vector<planner::PlannedMove> corner(const Case& of, double accel_mm_s2);

}  // namespace unflex::study
