// The nozzle of a machine with a shaper, from the nozzle of the same machine without one.
//
// A shaper's base is a weighted sum of delayed references, and the nozzle's response is linear. So
// the shaped nozzle is the same sum of the unshaped nozzle's own motion, delayed,
//
//   p_shaped(t) = Σ weight · p(t − time_s)
//
// exactly, whatever axis the nozzle really hangs on. Nothing has to be integrated again. The cost
// is one cubic per pulse, axis and moment. So a whole print can be compared with any number of
// shapers while it is replayed.
#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "unflex/core/axes.hpp"
#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/shapers.hpp"

namespace unflex::rivals {

// On the cubic through position and velocity at both ends of an interval of length h, at fraction
// u.
[[nodiscard]] dynamics::NozzleMotion on_cubic(const dynamics::NozzleMotion& a,
                                              const dynamics::NozzleMotion& b, double h, double u);

class ShapedNozzle {
 public:
  // The trains of the two axes may belong to different shapers. An empty train leaves its axis as
  // it is.
  explicit ShapedNozzle(const Axes<dynamics::ShaperPulses>& pulses);

  // Adds a sample of the unshaped nozzle; times must increase. Between samples the nozzle is on the
  // cubic through position and velocity (off by less than 1e-6 mm for samples 0.5 ms apart at 100
  // Hz and 10 000 mm/s²). Before the first sample it rests at that sample.
  void add(double time_s, const dynamics::NozzleMotionXY& unshaped);

  // The samples given so far determine the shaped nozzle up to this long before the last of them.
  [[nodiscard]] double lookahead_s() const { return lookahead_s_; }

  // The shaped nozzle's state at a time. For one that the samples do not determine yet, the
  // unshaped nozzle is taken to rest at the last sample. Times must not decrease from call to call,
  // because samples that no later time needs are forgotten.
  [[nodiscard]] dynamics::NozzleMotionXY at(double time_s);

 private:
  struct Sample {
    double time_s;
    dynamics::NozzleMotionXY nozzle;
  };
  struct Taps {
    dynamics::ShaperPulses pulses;
    std::vector<std::size_t> index;  // of the sample at or before the delayed time; one at least
  };

  [[nodiscard]] dynamics::NozzleMotion sum(std::size_t axis, double time_s);
  void forget_before(double time_s);

  Axes<Taps> taps_;
  double lookahead_s_ = 0.0;
  double memory_s_ = 0.0;
  std::deque<Sample> samples_;
  std::size_t forgotten_ = 0;
};

}  // namespace unflex::rivals
