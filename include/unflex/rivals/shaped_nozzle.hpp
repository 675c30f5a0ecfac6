// The nozzle of a shaped machine from that of the same machine without a shaper.
//
// A shaper's base is a weighted sum of delayed references, and the nozzle's response is linear. So
// the shaped nozzle is the same sum of the unshaped nozzle's own motion, delayed,
//
//   p_shaped(t) = Σ weight · p(t − time_s)
//
// exactly, whatever axis the nozzle really hangs on; nothing has to be integrated again. It costs a
// cubic per pulse, axis and moment, so that a whole print can be compared with any number of
// shapers while it is replayed.
#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/shapers.hpp"

namespace unflex::rivals {

class ShapedNozzle {
 public:
  // Either train may be that of another shaper; an empty one leaves its axis as it is.
  ShapedNozzle(const dynamics::ShaperPulses& x, const dynamics::ShaperPulses& y);

  // The unshaped nozzle, at times that increase; in between it is the cubic through position and
  // velocity (off by less than 1e-6 mm for samples 0.5 ms apart at 100 Hz and 10 000 mm/s²). Before
  // the first sample it rests there.
  void add(double time_s, const dynamics::NozzleXY& unshaped);

  // Up to when the samples given so far determine the shaped nozzle: lookahead_s() before the last.
  [[nodiscard]] double known_until_s() const;
  [[nodiscard]] double lookahead_s() const { return lookahead_s_; }

  // The shaped nozzle's state at a time up to known_until_s(); later it takes the last sample for
  // the unshaped nozzle's rest. Times must not decrease from call to call: what no later one needs
  // is forgotten.
  [[nodiscard]] dynamics::NozzleXY at(double time_s);

 private:
  struct Sample {
    double time_s;
    dynamics::NozzleXY nozzle;
  };
  struct Tap {
    dynamics::Pulse pulse;
    std::size_t index = 0;  // of the sample at or before the delayed time, never forgotten ones
  };

  [[nodiscard]] dynamics::NozzleState sum(std::vector<Tap>& taps,
                                          dynamics::NozzleState dynamics::NozzleXY::*axis,
                                          double time_s);
  void forget_before(double time_s);

  std::vector<Tap> x_;
  std::vector<Tap> y_;
  double lookahead_s_ = 0.0;
  double memory_s_ = 0.0;
  std::deque<Sample> samples_;
  std::size_t forgotten_ = 0;
};

}  // namespace unflex::rivals
