// The inner loops of the flat form, written so that the compiler takes several nodes at once.
// L is the number of coefficients used. Arrays are padded (padded.hpp).
#pragma once

#include <array>
#include <cstddef>
#include <utility>

#include "banded_ldlt.hpp"

namespace unflex::compensate::loops {

// y_k = Σ s_i x_{k+i}
template <std::size_t L>
inline void apply(const std::array<double, kHalfBand + 1>& s, const double* __restrict x,
                  double* __restrict y, std::size_t count) {
  for (std::size_t k = 0; k < count; ++k) {
    [&]<std::size_t... I>(std::index_sequence<I...>) { y[k] = ((s[I] * x[k + I]) + ...); }
    (std::make_index_sequence<L>{});
  }
}

// y_r += Σ s_i x_{r−i}, the transpose.
template <std::size_t L>
inline void add_transposed(const std::array<double, kHalfBand + 1>& s, const double* __restrict x,
                           double* __restrict y, std::size_t count) {
  for (std::size_t r = 0; r < count; ++r) {
    const double* const at = x + r;
    [&]<std::size_t... I>(std::index_sequence<I...>) {
      y[r] += ((s[I] * at[-static_cast<std::ptrdiff_t>(I)]) + ...);
    }
    (std::make_index_sequence<L>{});
  }
}

// One diagonal of add_squares(): products s_i s_{i+D}.
template <std::size_t L, std::size_t D>
inline void add_diagonal(const std::array<double, kHalfBand + 1>& s, const double* __restrict w,
                         double* __restrict to, std::size_t count) {
  std::array<double, kHalfBand + 1> product{};
  for (std::size_t i = 0; i + D < L; ++i) {
    product[i] = s[i] * s[i + D];
  }
  for (std::size_t r = 0; r < count; ++r) {
    const double* const at = w + r;
    [&]<std::size_t... I>(std::index_sequence<I...>) {
      to[r] += ((product[I] * at[-static_cast<std::ptrdiff_t>(I)]) + ...);
    }
    (std::make_index_sequence<L - D>{});
  }
}

// to += Σ_k w_k s sᵀ, with s standing at column k.
template <std::size_t L>
inline void add_squares(const std::array<double, kHalfBand + 1>& s, const double* w, BandMatrix& to,
                        std::size_t count) {
  [&]<std::size_t... D>(std::index_sequence<D...>) {
    (add_diagonal<L, D>(s, w, to[D].data(), count), ...);
  }
  (std::make_index_sequence<L>{});
}

}  // namespace unflex::compensate::loops
