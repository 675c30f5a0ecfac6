// The corners of the path that is measured against, on the clock of the nozzle that follows it.
#pragma once

#include <cstddef>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/verify/corners.hpp"
#include "unflex/verify/reference_path.hpp"

namespace unflex::verify {

class PathCorners {
 public:
  explicit PathCorners(double reach_s) : gauge_(reach_s) {}

  // Replaces the path so far by another one.
  void begin(const ReferencePath& path);
  // The path's present section begins, and the clock jumps back by this time.
  void begin_section(const ReferencePath& path, double clock_back_s);
  // The clock jumps back by this time within a section.
  void set_clock_back(double time_s) { shift_s_ += time_s; }
  // Takes the known pieces of the path in the sections that have begun.
  void follow(const ReferencePath& path);
  // The nozzle has moved for h seconds, which end at time_s.
  void pass(double time_s, const dynamics::NozzleMotionXY& from, const dynamics::NozzleMotionXY& to,
            double h);
  // Nothing is known of the nozzle's way from its last place to the next one.
  void lift() { gauge_.lift(); }
  [[nodiscard]] CornerStats stats() const { return gauge_.stats(); }

 private:
  CornerGauge gauge_;
  // The gauge has the pieces of the path before this one, in the sections up to this one.
  std::size_t piece_ = 0;
  std::size_t section_ = 0;
  // Added to the clock for the gauge, since the clock jumps where one path takes another's place.
  double shift_s_ = 0.0;
};

}  // namespace unflex::verify
