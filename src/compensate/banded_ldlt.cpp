#include "banded_ldlt.hpp"

namespace unflex::compensate {

BandedLdlt::Diagonals::Diagonals(const BandMatrix& h, std::size_t first, std::size_t last) {
  for (std::size_t d = 0; d <= kHalfBand; ++d) {
    from_first[d] = h[d].data() + first;
    from_last[d] = h[d].data() + last - d;
  }
}

inline void BandedLdlt::Diagonals::load(std::size_t r, std::size_t j, Window& w) const {
  for (std::size_t i = 0; i <= j; ++i) {
    const std::size_t d = j - i;
    w[i][j] = Pair(from_first[d][r + i], *(from_last[d] - r - i));
  }
}

bool BandedLdlt::factor(const BandMatrix& h, std::size_t first, std::size_t last) {
  first_ = first;
  size_ = last - first + 1;
  const std::size_t steps = (size_ - kHalfBand) / 2;
  middle_size_ = size_ - 2 * steps;
  columns_.resize(steps);
  const Diagonals diagonals(h, first, last);
  Window left;
  if (!(eliminate(diagonals, left).minCoeff() > 0.0)) {
    return false;
  }
  set_middle(diagonals, left);
  return factor_middle();
}

BandedLdlt::Pair BandedLdlt::eliminate(const Diagonals& h, Window& left) {
  // A variable of its own cannot overlap columns_, so it may stay in registers.
  Window w;
  for (std::size_t j = 0; j < kHalfBand; ++j) {
    h.load(0, j, w);
  }
  Pair smallest = w[0][0];
  for (std::size_t r = 0; r < columns_.size(); ++r) {
    h.load(r, kHalfBand, w);
    Column& column = columns_[r];
    smallest = smallest.min(w[0][0]);
    const Pair inverse = 1.0 / w[0][0];
    column.inverse_pivot = inverse;
    std::array<Pair, kHalfBand> row;
    for (std::size_t i = 0; i < kHalfBand; ++i) {
      row[i] = w[0][i + 1];
      column.below[i] = row[i] * inverse;
    }
    // The next pivot waits for nothing but the inverse of this one.
    const Pair next = w[1][1] - (row[0] * row[0]) * inverse;
    for (std::size_t i = 0; i < kHalfBand; ++i) {
      for (std::size_t j = i; j < kHalfBand; ++j) {
        w[i][j] = w[i + 1][j + 1] - row[i] * column.below[j];
      }
    }
    w[0][0] = next;
  }
  for (std::size_t i = 0; i < kHalfBand; ++i) {
    for (std::size_t j = i; j < kHalfBand; ++j) {
      left[i][j] = w[i][j];
    }
  }
  return smallest;
}

void BandedLdlt::set_middle(const Diagonals& h, const Window& left) {
  const std::size_t steps = columns_.size();
  middle_.setZero();
  for (std::size_t i = 0; i < middle_size_; ++i) {
    for (std::size_t j = i; j < middle_size_ && j - i <= kHalfBand; ++j) {
      middle_(j, i) = h.from_first[j - i][steps + i];
    }
  }
  const std::size_t end = middle_size_ - 1;
  for (std::size_t i = 0; i < kHalfBand; ++i) {
    for (std::size_t j = i; j < kHalfBand; ++j) {
      const std::size_t d = j - i;
      middle_(j, i) += left[i][j](0) - h.from_first[d][steps + i];
      middle_(end - i, end - j) += left[i][j](1) - *(h.from_last[d] - steps - i);
    }
  }
}

bool BandedLdlt::factor_middle() {
  for (std::size_t k = 0; k < middle_size_; ++k) {
    if (!(middle_(k, k) > 0.0)) {
      return false;
    }
    const double inverse = 1.0 / middle_(k, k);
    for (std::size_t j = k + 1; j < middle_size_; ++j) {
      const double below = middle_(j, k) * inverse;
      for (std::size_t i = j; i < middle_size_; ++i) {
        middle_(i, j) -= middle_(i, k) * below;
      }
    }
    for (std::size_t j = k + 1; j < middle_size_; ++j) {
      middle_(j, k) *= inverse;
    }
    middle_(k, k) = inverse;
  }
  return true;
}

void BandedLdlt::solve(double* x) const {
  const std::size_t steps = columns_.size();
  double* const from_first = x + first_;
  double* const from_last = x + first_ + size_ - 1;
  const auto load = [&](std::size_t r) { return Pair(from_first[r], *(from_last - r)); };
  const auto store = [&](std::size_t r, const Pair& value) {
    from_first[r] = value(0);
    *(from_last - r) = value(1);
  };
  // Rows that both sides reach get the updates of both, so updates are summed apart.
  Pair update[kHalfBand + 1] = {Pair::Zero(), Pair::Zero(), Pair::Zero(),
                                Pair::Zero(), Pair::Zero(), Pair::Zero()};
  for (std::size_t r = 0; r < steps; ++r) {
    const Column& column = columns_[r];
    const Pair value = load(r) - update[0];
    for (std::size_t i = 0; i < kHalfBand; ++i) {
      update[i] = update[i + 1] + column.below[i] * value;
    }
    store(r, value);
  }
  double* const middle = from_first + steps;
  const std::size_t end = middle_size_ - 1;
  for (std::size_t i = 0; i < kHalfBand; ++i) {
    middle[i] -= update[i](0);
    middle[end - i] -= update[i](1);
  }
  for (std::size_t j = 0; j < middle_size_; ++j) {
    for (std::size_t i = j + 1; i < middle_size_; ++i) {
      middle[i] -= middle_(i, j) * middle[j];
    }
  }
  for (std::size_t j = middle_size_; j-- > 0;) {
    middle[j] *= middle_(j, j);
    for (std::size_t i = j + 1; i < middle_size_; ++i) {
      middle[j] -= middle_(i, j) * middle[i];
    }
  }
  Pair next[kHalfBand];
  for (std::size_t i = 0; i < kHalfBand; ++i) {
    next[i] = Pair(middle[i], middle[end - i]);
  }
  for (std::size_t r = steps; r-- > 0;) {
    const Column& column = columns_[r];
    // The farthest value first, since the nearest has only just been found.
    Pair value = load(r) * column.inverse_pivot;
    for (std::size_t i = kHalfBand; i-- > 0;) {
      value -= column.below[i] * next[i];
    }
    for (std::size_t i = kHalfBand - 1; i > 0; --i) {
      next[i] = next[i - 1];
    }
    next[0] = value;
    store(r, value);
  }
}

}  // namespace unflex::compensate
