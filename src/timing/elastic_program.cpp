#include "elastic_program.hpp"

#include <algorithm>
#include <cmath>

namespace unflex::timing {
namespace {

constexpr int kMostIterations = 60;
constexpr double kFirstMultiplier = 1.0;
constexpr double kFirstBreach = 0.1;
// The share of the way to the nearest bound that a step goes.
constexpr double kOfTheWay = 0.99;
// What a fixed unknown weighs.
constexpr double kFixed = 1e12;
constexpr double kStationary = 1e-2;

}  // namespace

template <int W>
void ElasticProgram<W>::reset(std::size_t unknowns) {
  size_ = unknowns;
  hessian_.assign(unknowns * W, 0.0);
  linear_.assign(unknowns, 0.0);
  fixed_.clear();
  gradients_.clear();
  first_.clear();
  values_.clear();
  prices_.clear();
  lower_.clear();
  upper_.clear();
}

template <int W>
void ElasticProgram<W>::add_square(std::size_t first, const Gradient& g, double v, double weight) {
  for (int i = 0; i < W; ++i) {
    const double scaled = weight * g[i];
    if (scaled == 0.0) {
      continue;
    }
    linear_[first + i] += scaled * v;
    double* const column = &hessian_[(first + i) * W];
    for (int j = i; j < W; ++j) {
      column[j - i] += scaled * g[j];
    }
  }
}

template <int W>
void ElasticProgram<W>::add_damping(double weight) {
  for (std::size_t i = 0; i < size_; ++i) {
    hessian_[i * W] += weight;
  }
}

template <int W>
void ElasticProgram<W>::fix(std::size_t unknown) {
  fixed_.push_back(unknown);
}

template <int W>
void ElasticProgram<W>::add_row(std::size_t first, const Gradient& g, double v, double lower,
                                double upper, double price) {
  gradients_.push_back(g);
  first_.push_back(first);
  values_.push_back(v);
  lower_.push_back(lower);
  upper_.push_back(upper);
  prices_.push_back(price);
}

template <int W>
void ElasticProgram<W>::start() {
  sides_.clear();
  const auto add = [&](std::size_t row, double sign, double room) {
    Side side;
    side.row = row;
    side.sign = sign;
    side.multiplier = std::min(kFirstMultiplier, 0.5 * prices_[row]);
    side.slack = prices_[row] - side.multiplier;
    side.breach = std::max(0.0, -room) + kFirstBreach;
    side.room = room + side.breach;
    sides_.push_back(side);
  };
  for (std::size_t row = 0; row < first_.size(); ++row) {
    if (std::isfinite(upper_[row])) {
      add(row, 1.0, upper_[row] - values_[row]);
    }
    if (std::isfinite(lower_[row])) {
      add(row, -1.0, values_[row] - lower_[row]);
    }
  }
  delta_.assign(size_, 0.0);
}

template <int W>
double ElasticProgram<W>::linearise() {
  lagrangian_ = linear_;
  for (std::size_t i = 0; i < size_; ++i) {
    const double* const column = &hessian_[i * W];
    const std::size_t count = std::min<std::size_t>(W, size_ - i);
    const double own = delta_[i];
    double sum = column[0] * own;
    for (std::size_t k = 1; k < count; ++k) {
      sum += column[k] * delta_[i + k];
      lagrangian_[i + k] += column[k] * own;
    }
    lagrangian_[i] += sum;
  }
  // Columns beyond the last one keep the loops of factor() even.
  factor_.assign((size_ + W) * W, 0.0);
  std::copy(hessian_.begin(), hessian_.end(), factor_.begin());
  // Rows whose unknowns begin at the same place stand together, and so does their sum.
  Eigen::Matrix<double, W, W> block;
  std::size_t side = 0;
  for (std::size_t row = 0; row < first_.size();) {
    const std::size_t first = first_[row];
    block.setZero();
    for (; row < first_.size() && first_[row] == first; ++row) {
      double stiffness = 0.0;
      double multiplier = 0.0;
      for (; side < sides_.size() && sides_[side].row == row; ++side) {
        stiffness += sides_[side].stiffness();
        multiplier += sides_[side].sign * sides_[side].multiplier;
      }
      const Gradient& g = gradients_[row];
      at(lagrangian_, row) += multiplier * g;
      for (int i = 0; i < W; ++i) {
        block.col(i) += (stiffness * g[i]) * g;
      }
    }
    for (int i = 0; i < W; ++i) {
      double* const column = &factor_[(first + i) * W];
      for (int j = i; j < W; ++j) {
        column[j - i] += block(j, i);
      }
    }
  }
  double largest = 0.0;
  for (const std::size_t i : fixed_) {
    lagrangian_[i] = 0.0;
    factor_[i * W] += kFixed;
  }
  for (const double value : lagrangian_) {
    largest = std::max(largest, std::abs(value));
  }
  return largest;
}

template <int W>
bool ElasticProgram<W>::factor() {
  for (std::size_t i = 0; i < size_; ++i) {
    double* const column = &factor_[i * W];
    if (!(column[0] > 0.0)) {
      return false;
    }
    const double inverse = 1.0 / column[0];
    for (int j = 1; j < W; ++j) {
      const double share = column[j] * inverse;
      double* const other = &factor_[(i + j) * W];
      for (int k = j; k < W; ++k) {
        other[k - j] -= share * column[k];
      }
    }
    for (int j = 1; j < W; ++j) {
      column[j] *= inverse;
    }
  }
  return true;
}

template <int W>
void ElasticProgram<W>::back_substitute(std::vector<double>& x) const {
  for (std::size_t i = 0; i < size_; ++i) {
    const double* const column = &factor_[i * W];
    const std::size_t count = std::min<std::size_t>(W, size_ - i);
    for (std::size_t k = 1; k < count; ++k) {
      x[i + k] -= column[k] * x[i];
    }
  }
  for (std::size_t i = size_; i-- > 0;) {
    const double* const column = &factor_[i * W];
    const std::size_t count = std::min<std::size_t>(W, size_ - i);
    double sum = x[i] / column[0];
    for (std::size_t k = 1; k < count; ++k) {
      sum -= column[k] * x[i + k];
    }
    x[i] = sum;
  }
}

template <int W>
double ElasticProgram<W>::step_towards(double target, bool corrects) {
  for (std::size_t i = 0; i < size_; ++i) {
    step_[i] = -lagrangian_[i];
  }
  // The force of a side: (τ − λw − …)/λ − (τ − μs − …)/μ.
  const auto force = [&](const Side& side) {
    const double room = target - side.multiplier * side.room - (corrects ? side.room_product : 0.0);
    const double breach =
        target - side.slack * side.breach - (corrects ? side.breach_product : 0.0);
    return std::pair(room / side.multiplier, breach / side.slack);
  };
  for (std::size_t i = 0; i < sides_.size();) {
    const std::size_t row = sides_[i].row;
    double net = 0.0;
    for (; i < sides_.size() && sides_[i].row == row; ++i) {
      const auto [room, breach] = force(sides_[i]);
      net += sides_[i].sign * sides_[i].stiffness() * (room - breach);
    }
    at(step_, row) -= net * gradients_[row];
  }
  for (const std::size_t i : fixed_) {
    step_[i] = 0.0;
  }
  back_substitute(step_);
  double length = 1.0 / kOfTheWay;
  for (std::size_t i = 0; i < sides_.size();) {
    const std::size_t row = sides_[i].row;
    const double along = gradients_[row].dot(at(step_, row));
    for (; i < sides_.size() && sides_[i].row == row; ++i) {
      Side& side = sides_[i];
      const auto [room, breach] = force(side);
      side.multiplier_step = side.stiffness() * (side.sign * along + room - breach);
      side.breach_step = breach + side.breach / side.slack * side.multiplier_step;
      side.room_step = side.breach_step - side.sign * along;
      if (side.room_step < 0.0) {
        length = std::min(length, -side.room / side.room_step);
      }
      if (side.breach_step < 0.0) {
        length = std::min(length, -side.breach / side.breach_step);
      }
      if (side.multiplier_step < 0.0) {
        length = std::min(length, -side.multiplier / side.multiplier_step);
      } else if (side.multiplier_step > 0.0) {
        length = std::min(length, side.slack / side.multiplier_step);
      }
      if (!corrects) {
        side.room_product = side.multiplier_step * side.room_step;
        side.breach_product = -side.multiplier_step * side.breach_step;
      }
    }
  }
  return kOfTheWay * length;
}

template <int W>
double ElasticProgram<W>::gap() const {
  return gap_after(0.0);
}

template <int W>
double ElasticProgram<W>::gap_after(double length) const {
  double sum = 0.0;
  for (const Side& side : sides_) {
    sum +=
        (side.multiplier + length * side.multiplier_step) * (side.room + length * side.room_step) +
        (side.slack - length * side.multiplier_step) * (side.breach + length * side.breach_step);
  }
  return sum;
}

template <int W>
void ElasticProgram<W>::advance(double length) {
  for (std::size_t i = 0; i < size_; ++i) {
    delta_[i] += length * step_[i];
  }
  for (Side& side : sides_) {
    side.multiplier += length * side.multiplier_step;
    side.slack -= length * side.multiplier_step;
    side.room += length * side.room_step;
    side.breach += length * side.breach_step;
  }
}

template <int W>
std::optional<std::span<const double>> ElasticProgram<W>::solve(double gap_per_unknown,
                                                                int& iterations) {
  start();
  step_.assign(size_, 0.0);
  const double enough = gap_per_unknown * static_cast<double>(size_);
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    const double largest = linearise();
    const double now = gap();
    if (now <= enough && largest <= kStationary && (iteration > 0 || !sides_.empty())) {
      return delta_;
    }
    if (!factor()) {
      return std::nullopt;
    }
    ++iterations;
    if (sides_.empty()) {
      step_towards(0.0, false);
      advance(1.0);
      return delta_;
    }
    const double foreseen = step_towards(0.0, false);
    const double left = gap_after(foreseen) / now;
    const double target = left * left * left * now / (2.0 * static_cast<double>(sides_.size()));
    advance(step_towards(target, true));
  }
  return std::nullopt;
}

template <int W>
double ElasticProgram<W>::value_at_solution(std::size_t row) const {
  return values_[row] +
         gradients_[row].dot(Eigen::Map<const Gradient>(delta_.data() + first_[row]));
}

template class ElasticProgram<18>;
template class ElasticProgram<24>;

}  // namespace unflex::timing
