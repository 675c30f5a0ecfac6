// What the motion of a compensated run must keep to besides the limits of BaseCheck: the budget of
// lines, the neighbourhood of its plan, a tail without filament, and a nozzle that strays no more
// than the sliced file's.
//
// Notation:
//   ω, ζ   of the softer axis              A, v   largest acceleration of a base, its speed
//   A/ω² + 2ζv/ω   how far a base is from the nozzle that follows it, and so from the plan
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

  void begin(const LineRate& rate_before);
  // A move of the sliced file's run by itself, as it would come here.
  void add_sliced(const planner::PlannedMove& move) { sliced_rate_.add(move); }
  // A move of the emitted run, after it has been played. late: the plan had ended when it began.
  void add(const planner::PlannedMove& move, Meter& meter, bool late, double filament_tolerance_mm);
  void end(const LineRate& rate, const SectionError& sliced, const SectionError& emitted);

 private:
  // The worst breach of a rule.
  struct Worst {
    double excess = 0.0;
    double value = 0.0;
    std::size_t line = 0;
    void offer(double a_value, double limit, std::size_t a_line);
  };
  void check_rate(const LineRate& rate);
  void check_nozzle(const SectionError& sliced, const SectionError& emitted);

  const Rules* rules_;
  Violations* violations_;
  LineRate sliced_rate_;
  std::size_t first_line_ = 0;
  Worst offset_;
  Worst tail_;
};

}  // namespace unflex::verify
