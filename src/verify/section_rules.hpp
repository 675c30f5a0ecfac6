// The rules for the motion of a compensated run, besides the limits of BaseCheck. The run keeps to
// the budget of lines. Its base stays near the path. Its tail lays no filament. Its nozzle, in the
// tail too, strays no more than if the run had been kept as it was sliced.
//
// Notation:
//   ω, ζ   of an axis                      A, v   largest acceleration of a base, its speed
//   A/ω² + 2ζv/ω   how far a base is from the nozzle that follows it, and so from the path
#pragma once

#include <cstddef>

#include "meter.hpp"
#include "unflex/verify/line_rate.hpp"
#include "unflex/verify/verify.hpp"
#include "violations.hpp"

namespace unflex::verify {

class SectionRules {
 public:
  SectionRules(const Rules& rules, Violations& violations)
      : rules_(&rules), violations_(&violations) {}

  // ringing: kept motion just before the run has set the nozzle swinging.
  void begin(const LineRate& rate_before, bool ringing, bool has_free_timing);
  // A sliced move of the run, planned by itself from rest to rest.
  void add_sliced(const planner::PlannedMove& move) { sliced_rate_.add(move); }
  // A move of the emitted run, after it has been played. late: the plan had ended when it began.
  void add(const planner::PlannedMove& move, Meter& meter, bool late, double filament_tolerance_mm);
  // The whole run has been played: as emitted, and as if its sliced moves had been kept.
  // base_max_accel_mm_s2: the acceleration that its motors may have had.
  void end(const LineRate& rate, const Meter& kept, const Meter& emitted,
           double base_max_accel_mm_s2);

 private:
  // The first breach of a rule.
  struct Breach {
    double value = 0.0;
    std::size_t line = 0;
    void offer(double a_value, double limit, std::size_t a_line);
  };
  // How far the base may be from the path at a speed.
  [[nodiscard]] double largest_offset_mm(double max_accel_mm_s2, double v_mm_s) const;
  void check_rate(const LineRate& rate);
  void check_nozzle(const Meter& kept, const Meter& emitted);
  void check_swing(const Meter& kept, const Meter& emitted);
  void check_filament();

  const Rules* rules_;
  Violations* violations_;
  LineRate sliced_rate_;
  bool ringing_ = false;
  bool has_free_timing_ = false;
  double densest_ = 0.0;  // most filament per path, mm/mm
  std::size_t first_line_ = 0;
  std::size_t last_line_ = 0;
  // Where the base was furthest from the path, beyond what the rules' own acceleration allows.
  struct Offset {
    double over_mm = 0.0;
    double value_mm = 0.0;
    double speed_mm_s = 0.0;
    std::size_t line = 0;
  };
  Offset offset_;
  Breach filament_in_tail_;
  double swing_in_tail_mm_ = 0.0;  // largest swing in the tail
  std::size_t swing_line_ = 0;
};

}  // namespace unflex::verify
