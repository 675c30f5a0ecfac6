// Derivatives by time where time itself is a spline.
//
//   u      node number         T(u)   time
//   X(u)   a function of u, with derivatives X', X'', … by u
//   y_k    its k-th derivative by time:  y_k = Σ_j B_kj X^(j)
//
// B_kj are the partial Bell polynomials of the derivatives of u by time (Faà di Bruno's formula;
// Comtet, "Advanced Combinatorics", III.3). The derivatives u_k follow from T itself, whose first
// derivative by time is 1 and whose others are 0.
//
// If T becomes T + δT at fixed u, a function of time becomes later by θ = δT, and y_k at the same u
// changes by
//
//   δy_k = −Σ_{j=1..k} binomial(k, j) y_{k+1−j} θ_j,    θ_j = Σ_i B_ji δT^(i)
#pragma once

#include <array>
#include <cstddef>

namespace unflex::timing {

// Values for the derivatives 0 … K − 1.
template <int K>
using Derivatives = std::array<double, K>;

template <int K>
constexpr std::array<std::array<double, K>, K> binomials() {
  std::array<std::array<double, K>, K> c{};
  for (int n = 0; n < K; ++n) {
    c[n][0] = 1.0;
    for (int k = 1; k <= n; ++k) {
      c[n][k] = c[n - 1][k - 1] + (k < n ? c[n - 1][k] : 0.0);
    }
  }
  return c;
}

template <int K>
class TimeDerivatives {
 public:
  // time: T and its derivatives by u.
  explicit TimeDerivatives(const Derivatives<K>& time) {
    constexpr auto c = binomials<K>();
    Derivatives<K> u{};
    b_[0][0] = 1.0;
    for (int n = 1; n < K; ++n) {
      double of_time = n == 1 ? 1.0 : 0.0;
      for (int j = 2; j <= n; ++j) {
        double sum = 0.0;
        for (int i = 0; i <= n - j; ++i) {
          sum += c[n - 1][i] * u[i + 1] * b_[n - 1 - i][j - 1];
        }
        b_[n][j] = sum;
        of_time -= sum * time[j];
      }
      u[n] = of_time / time[1];
      b_[n][1] = u[n];
    }
  }

  // y_k of a function whose derivatives by u are given.
  [[nodiscard]] Derivatives<K> by_time(const Derivatives<K>& by_node) const {
    Derivatives<K> y{};
    for (int k = 0; k < K; ++k) {
      for (int j = 0; j <= k; ++j) {
        y[k] += b_[k][j] * by_node[j];
      }
    }
    return y;
  }

  // The gradient of Σ_k a_k y_k in X and its derivatives by u.
  [[nodiscard]] Derivatives<K> by_function(const Derivatives<K>& a) const {
    Derivatives<K> gradient{};
    for (int k = 0; k < K; ++k) {
      for (int j = 0; j <= k; ++j) {
        gradient[j] += a[k] * b_[k][j];
      }
    }
    return gradient;
  }

  // The gradient of Σ_k a_k y_k in T and its derivatives by u.
  [[nodiscard]] Derivatives<K> by_clock(const Derivatives<K>& a, const Derivatives<K>& y) const {
    constexpr auto c = binomials<K>();
    Derivatives<K> gradient{};
    for (int j = 1; j < K; ++j) {
      double of_theta = 0.0;
      for (int k = j; k < K; ++k) {
        of_theta -= c[k][j] * a[k] * y[k + 1 - j];
      }
      for (int i = 1; i <= j; ++i) {
        gradient[i] += of_theta * b_[j][i];
      }
    }
    return gradient;
  }

 private:
  std::array<std::array<double, K>, K> b_{};
};

}  // namespace unflex::timing
