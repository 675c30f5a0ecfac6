// The second stage: a base that makes up for the axes is shaped once more, against a mode that was
// found behind them (Cisalpino, UFLA, 2023, § 4.3.1).
//
//   b'(t) = Σ A_i b(t − t_i)       A_i, t_i   pulses of an input shaper; Σ A_i t_i = 0
//
// As a weighted mean of motions that keep the limits, b' keeps them, too.
#pragma once

#include <cstddef>

#include "unflex/compensate/run.hpp"
#include "unflex/dynamics/base_trajectory.hpp"

namespace unflex::compensate {

// By how many nodes a shaped base begins before the base and ends after it; 0 without pulses.
[[nodiscard]] std::size_t nodes_of_shaping(const Setup& setup, double period_s);

// The base shaped by the pulses of X and Y. It has nodes_of_shaping() nodes more at its beginning
// and at its end. The unshaped base rests beyond its ends. Axes that share motors are both shaped
// by the pulses of either, since their limits hold for positions of the same moment.
[[nodiscard]] dynamics::BaseTrajectory shaped(const dynamics::BaseTrajectory& base,
                                              const Setup& setup, std::size_t more_before,
                                              std::size_t more_after);

}  // namespace unflex::compensate
