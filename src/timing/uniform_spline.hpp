// Uniform B-splines of degree D, one control point per node and D − 1 more.
//
//   u   place in nodes: between node k and node k + 1 it is k + x, 0 ≤ x ≤ 1
//   c   control points; between node k and the next, those from number k to k + D have a share
#pragma once

#include <array>
#include <cstddef>

namespace unflex::timing {

// [j][i]: what control point k + i adds to the j-th derivative by u, at one x.
template <int D>
using SplineShares = std::array<std::array<double, D + 1>, D>;

// The j-th derivative of the cardinal B-spline of a degree, which is not zero from 0 to degree + 1
// (de Boor, "A Practical Guide to Splines", IX (14) and X (15), for uniform knots).
constexpr double cardinal_spline(int degree, int derivative, double t) {
  if (t < 0.0 || t > degree + 1.0) {
    return 0.0;
  }
  if (derivative > 0) {
    return cardinal_spline(degree - 1, derivative - 1, t) -
           cardinal_spline(degree - 1, derivative - 1, t - 1.0);
  }
  if (degree == 0) {
    return t < 1.0 ? 1.0 : 0.0;
  }
  return (t * cardinal_spline(degree - 1, 0, t) +
          (degree + 1 - t) * cardinal_spline(degree - 1, 0, t - 1.0)) /
         degree;
}

// [i][m]: the share of control point k + i is Σ_m [i][m] x^m, by Taylor's formula.
template <int D>
inline constexpr auto kSplinePieces = [] {
  std::array<std::array<double, D + 1>, D + 1> pieces{};
  for (int i = 0; i <= D; ++i) {
    double factorial = 1.0;
    for (int m = 0; m <= D; ++m) {
      factorial *= m > 0 ? m : 1;
      pieces[i][m] = cardinal_spline(D, m, D - i) / factorial;
    }
  }
  return pieces;
}();

template <int D>
constexpr SplineShares<D> spline_shares(double x) {
  SplineShares<D> shares{};
  for (int i = 0; i <= D; ++i) {
    std::array<double, D + 1> terms = kSplinePieces<D>[i];  // of the j-th derivative
    for (int j = 0; j < D; ++j) {
      double value = 0.0;
      for (int m = D - j; m >= 0; --m) {
        value = value * x + terms[m];
      }
      shares[j][i] = value;
      for (int m = 0; m < D - j; ++m) {
        terms[m] = (m + 1) * terms[m + 1];
      }
    }
  }
  return shares;
}

// Shares at kLooks places of a period, and at its end.
inline constexpr int kLooks = 4;
template <int D>
inline constexpr auto kSharesAtLooks = [] {
  std::array<SplineShares<D>, kLooks + 1> shares{};
  for (int look = 0; look <= kLooks; ++look) {
    shares[look] = spline_shares<D>(static_cast<double>(look) / kLooks);
  }
  return shares;
}();

}  // namespace unflex::timing
