// The fastest motion along a section.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "sections.hpp"
#include "unflex/core/axes.hpp"
#include "unflex/core/xy.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::timing {

// Axes that the machine may have instead, whose frequencies are a little different.
struct SectionEdge : Axes<dynamics::FlexibleAxis> {
  XY off;  // ω over the given axis' ω, minus 1
};

// Rules that the motion has to keep.
struct SectionRules : Axes<dynamics::Mode> {
  // Limits of the base's place.
  Axes<compensate::BaseLimits> limits;
  // Axes at the edges of a band. Their nozzles may stray times_tolerance tolerances, but no more
  // than travel may.
  std::vector<SectionEdge> edges;
  double times_tolerance = 2.0;
  double max_accel_mm_s2 = 0.0;  // of the base, per axis
  bool shares_motors = false;    // the limit is of |ẍ ± ÿ| instead
};

// The time at which the nozzle passes a place on a leg.
struct Passage {
  double time_s = 0.0;
  std::size_t leg = 0;
  double along_mm = 0.0;
};

class SectionMotion {
 public:
  SectionMotion() = default;
  SectionMotion(const SectionMotion&) = delete;
  SectionMotion& operator=(const SectionMotion&) = delete;
  virtual ~SectionMotion() = default;

  [[nodiscard]] virtual double duration_s() const = 0;
  // Place and speed of the base, t from 0 to duration_s().
  struct OfAxis {
    double position_mm = 0.0;
    double velocity_mm_s = 0.0;
  };
  using Base = Axes<OfAxis>;
  [[nodiscard]] virtual Base base(double t) const = 0;
  // The nozzles of SectionRules::edges at the end.
  [[nodiscard]] virtual std::vector<dynamics::NozzleXY> edge_nozzles() const = 0;
  // In the order of time, from the first leg's beginning to the last one's end.
  [[nodiscard]] virtual std::vector<Passage> passages() const = 0;
};

// nullptr: none was found that keeps the rules.
[[nodiscard]] std::unique_ptr<SectionMotion> fastest_motion(const Section& section,
                                                            const SectionRules& rules);

}  // namespace unflex::timing
