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

template <int D>
constexpr SplineShares<D> spline_shares(double x) {
  SplineShares<D> shares{};
  for (int j = 0; j < D; ++j) {
    for (int i = 0; i <= D; ++i) {
      shares[j][i] = cardinal_spline(D, j, x + D - i);
    }
  }
  return shares;
}

}  // namespace unflex::timing
