// An axis of one mode, written in a flat output: a function of time that may be chosen freely, and
// from which nozzle and base follow by derivatives.
//
//   s   d/dt     a = 2ζ/ω     κ = 1/ω²     D = 1 + a s + κ s²
//
//   y:   p = (1 + a s) y        b = D y
//   z:   p = (1 + a s) D z      b = D² z      ∂p/∂ln ω = κ (2 + a s) s² z
//
// z is smoother than y. It also tells how the nozzle of an axis strays whose frequency is a little
// different, on the same base.
#pragma once

#include "time_derivatives.hpp"
#include "unflex/dynamics/flexible_axis.hpp"

namespace unflex::timing {

// Factors of the flat output's derivatives.
template <int K>
struct FlatOutput {
  Derivatives<K> nozzle{};        // p
  Derivatives<K> nozzle_speed{};  // ṗ
  Derivatives<K> base{};          // b
  Derivatives<K> base_speed{};    // ḃ
  Derivatives<K> base_accel{};    // b̈
  Derivatives<K> sensitivity{};   // ∂p/∂ln ω; 0 for y
};

template <int K>
constexpr Derivatives<K> once_more(const Derivatives<K>& factors) {
  Derivatives<K> result{};
  for (int i = 1; i < K; ++i) {
    result[i] = factors[i - 1];
  }
  return result;
}

// y if there are five derivatives, z if there are seven. Time is counted in units of unit_s.
template <int K>
FlatOutput<K> flat_output(const dynamics::Mode& mode, double unit_s) {
  static_assert(K == 5 || K == 7);
  const double a = 2.0 * mode.zeta / (mode.omega_rad_s * unit_s);
  const double kappa = 1.0 / (mode.omega_rad_s * mode.omega_rad_s * unit_s * unit_s);
  FlatOutput<K> flat;
  if constexpr (K == 5) {
    flat.nozzle = {1.0, a};
    flat.base = {1.0, a, kappa};
  } else {
    flat.nozzle = {1.0, 2.0 * a, a * a + kappa, a * kappa};
    flat.base = {1.0, 2.0 * a, a * a + 2.0 * kappa, 2.0 * a * kappa, kappa * kappa};
    flat.sensitivity = {0.0, 0.0, 2.0 * kappa, a * kappa};
  }
  flat.nozzle_speed = once_more<K>(flat.nozzle);
  flat.base_speed = once_more<K>(flat.base);
  flat.base_accel = once_more<K>(flat.base_speed);
  return flat;
}

// Each of them for all axes.
template <int K>
struct FlatOutputs {
  Axes<Derivatives<K>> nozzle;
  Axes<Derivatives<K>> nozzle_speed;
  Axes<Derivatives<K>> base;
  Axes<Derivatives<K>> base_speed;
  Axes<Derivatives<K>> base_accel;
  Axes<Derivatives<K>> sensitivity;
};

template <int K>
FlatOutputs<K> of_all_axes(const Axes<FlatOutput<K>>& flat) {
  const auto each = [&](Derivatives<K> FlatOutput<K>::*which) {
    return map_axes([&](const FlatOutput<K>& of_axis) { return of_axis.*which; }, flat);
  };
  using Flat = FlatOutput<K>;
  return {each(&Flat::nozzle),     each(&Flat::nozzle_speed), each(&Flat::base),
          each(&Flat::base_speed), each(&Flat::base_accel),   each(&Flat::sensitivity)};
}

}  // namespace unflex::timing
