// L D Lᵀ of a symmetric positive definite matrix of half-bandwidth 5, and solving with it.
//
// Each step of the factorisation waits for the pivot of the step before, and this wait is most of
// its time. So both ends are eliminated at once, in the two lanes of one register, towards a middle
// block of five or six rows ("twisted" factorisation; Meurant, "A review on the inverse of
// symmetric tridiagonal and block tridiagonal matrices", SIAM J. Matrix Anal. Appl. 13 (1992)).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "padded.hpp"

namespace unflex::compensate {

inline constexpr std::size_t kHalfBand = 5;

// Diagonals of the upper triangle: [d][r] stands at row r, column r + d.
using BandMatrix = std::array<Padded, kHalfBand + 1>;

class BandedLdlt {
 public:
  // Factorises the rows and columns first … last of h, at least five. Returns false if a pivot is
  // not positive; then the factor is of no use.
  [[nodiscard]] bool factor(const BandMatrix& h, std::size_t first, std::size_t last);

  // x ← H⁻¹ x on first … last. Entries beside them are not touched.
  void solve(double* x) const;

 private:
  using Pair = Eigen::Array2d;  // one step's values, from the first row and from the last
  using Middle = Eigen::Matrix<double, kHalfBand + 1, kHalfBand + 1>;

  struct Column {
    Pair inverse_pivot;
    std::array<Pair, kHalfBand> below;  // L at the next five rows
  };

  // The part of the matrix that a step changes: rows and columns r … r + 5 after r steps, upper
  // triangle.
  using Window = std::array<std::array<Pair, kHalfBand + 1>, kHalfBand + 1>;

  // The diagonals of the matrix, as seen from the first row and from the last one.
  struct Diagonals {
    Diagonals(const BandMatrix& h, std::size_t first, std::size_t last);
    // Takes column j of the window after r steps from the matrix.
    void load(std::size_t r, std::size_t j, Window& w) const;

    std::array<const double*, kHalfBand + 1> from_first;
    std::array<const double*, kHalfBand + 1> from_last;
  };

  // Eliminates the rows at both ends, up to the middle block. Sets `left` to what is left of the
  // matrix behind them, and returns the smallest pivots.
  Pair eliminate(const Diagonals& h, Window& left);
  // Sets the middle block to the matrix itself and the updates of both sides.
  void set_middle(const Diagonals& h, const Window& left);
  // Factorises the middle block, whose lower triangle is given. Returns false if a pivot is not
  // positive.
  [[nodiscard]] bool factor_middle();

  std::size_t first_ = 0;
  std::size_t size_ = 0;
  std::vector<Column> columns_;
  Middle middle_;  // L below the diagonal, 1/D on it
  std::size_t middle_size_ = 0;
};

}  // namespace unflex::compensate
