#include "unflex/quadratic/elastic_program.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

#include "unflex/core/wide_registers.hpp"

namespace unflex::quadratic {
namespace {

constexpr int kMostIterations = 60;
constexpr double kFirstMultiplier = 1.0;
constexpr double kFirstBreach = 0.1;
// A step goes this share of the way to the nearest bound.
constexpr double kOfTheWay = 0.99;
// Weight on the diagonal that holds a fixed unknown.
constexpr double kFixed = 1e12;
constexpr double kStationary = 1e-2;
// A row that is less stiff is left out of the matrix, where it would not matter.
constexpr double kStiff = 1e-6;

#define UNFLEX_INLINE [[gnu::always_inline]] inline

template <int W>
using Width = std::integral_constant<int, W>;

// W × W, by columns. Entries above the diagonal are not used.
template <int W>
using Block = std::array<double, W * W>;

// block += f g gᵀ
template <int W>
UNFLEX_INLINE void add_square_to(const double* __restrict g, double f, double* __restrict block) {
  constexpr int kLanes = 4;
  for (int i = 0; i < W; ++i) {
    const double scaled = f * g[i];
    for (int j = i / kLanes * kLanes; j < W; ++j) {
      block[i * W + j] += scaled * g[j];
    }
  }
}

// block += Σ f_r g_r g_rᵀ over four rows, so that the block is read and written once.
template <int W>
UNFLEX_INLINE void add_squares_to(const double* const* rows, const double* f,
                                  double* __restrict block) {
  constexpr int kLanes = 4;
  const double* __restrict const a = rows[0];
  const double* __restrict const b = rows[1];
  const double* __restrict const c = rows[2];
  const double* __restrict const d = rows[3];
  for (int i = 0; i < W; ++i) {
    const double of_a = f[0] * a[i];
    const double of_b = f[1] * b[i];
    const double of_c = f[2] * c[i];
    const double of_d = f[3] * d[i];
    for (int j = i / kLanes * kLanes; j < W; ++j) {
      block[i * W + j] += (of_a * a[j] + of_b * b[j]) + (of_c * c[j] + of_d * d[j]);
    }
  }
}

// columns += block, from the diagonal down. A column of the band holds its W rows one after the
// other.
template <int W>
UNFLEX_INLINE void add_to_band(const Block<W>& block, double* columns) {
  for (int i = 0; i < W; ++i) {
    double* const column = columns + i * W;
    for (int j = i; j < W; ++j) {
      column[j - i] += block[i * W + j];
    }
  }
}

// y += f g
template <int W>
UNFLEX_INLINE void add_to(const double* __restrict g, double f, double* __restrict y) {
  for (int i = 0; i < W; ++i) {
    y[i] += f * g[i];
  }
}

// g·x, in four sums side by side.
template <int W>
UNFLEX_INLINE double product(const double* __restrict g, const double* __restrict x) {
  constexpr int kLanes = 4;
  constexpr int kWhole = W / kLanes * kLanes;
  double sums[kLanes] = {0.0, 0.0, 0.0, 0.0};
  for (int i = 0; i < kWhole; i += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      sums[lane] += g[i + lane] * x[i + lane];
    }
  }
  for (int i = kWhole; i < W; ++i) {
    sums[0] += g[i] * x[i];
  }
  return (sums[0] + sums[2]) + (sums[1] + sums[3]);
}

// L D Lᵀ in a band: column i holds what is at the diagonal and below.
template <int W>
UNFLEX_INLINE bool factor_columns(double* columns, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) {
    double* const column = columns + i * W;
    if (!(column[0] > 0.0)) {
      return false;
    }
    const double inverse = 1.0 / column[0];
    for (int j = 1; j < W; ++j) {
      const double share = column[j] * inverse;
      double* __restrict const other = columns + (i + j) * W;
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

// Attributes for wide registers need functions that are not templates.
#define UNFLEX_FOR_WIDTH(W)                                                                       \
  UNFLEX_WIDE void add_square_to(Width<W> /*width*/, const double* g, double f, double* block) {  \
    add_square_to<W>(g, f, block);                                                                \
  }                                                                                               \
  UNFLEX_WIDE void add_squares_to(Width<W> /*width*/, const double* const* rows, const double* f, \
                                  double* block) {                                                \
    add_squares_to<W>(rows, f, block);                                                            \
  }                                                                                               \
  UNFLEX_WIDE void add_to(Width<W> /*width*/, const double* g, double f, double* y) {             \
    add_to<W>(g, f, y);                                                                           \
  }                                                                                               \
  UNFLEX_WIDE double product(Width<W> /*width*/, const double* g, const double* x) {              \
    return product<W>(g, x);                                                                      \
  }                                                                                               \
  UNFLEX_WIDE bool factor_columns(Width<W> /*width*/, double* columns, std::size_t size) {        \
    return factor_columns<W>(columns, size);                                                      \
  }

UNFLEX_FOR_WIDTH(5)
UNFLEX_FOR_WIDTH(18)
UNFLEX_FOR_WIDTH(24)
UNFLEX_FOR_WIDTH(40)

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
void ElasticProgram<W>::start_lagrangian() {
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
}

template <int W>
typename ElasticProgram<W>::RowWeight ElasticProgram<W>::weigh(std::size_t row, std::size_t& side) {
  RowWeight weight;
  for (; side < sides_.size() && sides_[side].row == row; ++side) {
    Side& own = sides_[side];
    own.stiffness = 1.0 / (own.room / own.multiplier + own.breach / own.slack);
    weight.stiffness += own.stiffness;
    weight.multiplier += own.sign * own.multiplier;
    weight.force += own.sign * own.stiffness * (own.breach - own.room);
  }
  return weight;
}

template <int W>
std::size_t ElasticProgram<W>::add_rows_at(std::size_t row, std::size_t& side) {
  const std::size_t first = first_[row];
  Block<W> block{};
  const double* stiff_rows[4];
  double stiffnesses[4];
  int stiff = 0;
  for (; row < first_.size() && first_[row] == first; ++row) {
    const RowWeight weight = weigh(row, side);
    const Gradient& g = gradients_[row];
    add_to(Width<W>{}, g.data(), weight.multiplier, lagrangian_.data() + first);
    add_to(Width<W>{}, g.data(), -weight.force, step_.data() + first);
    if (weight.stiffness > kStiff) {
      stiff_rows[stiff] = g.data();
      stiffnesses[stiff++] = weight.stiffness;
      if (stiff == 4) {
        add_squares_to(Width<W>{}, stiff_rows, stiffnesses, block.data());
        stiff = 0;
      }
    }
  }
  for (int i = 0; i < stiff; ++i) {
    add_square_to(Width<W>{}, stiff_rows[i], stiffnesses[i], block.data());
  }
  add_to_band<W>(block, &factor_[first * W]);
  return row;
}

template <int W>
double ElasticProgram<W>::linearise() {
  start_lagrangian();
  // Columns beyond the last one keep the loops of factor() even.
  factor_.assign((size_ + W) * W, 0.0);
  std::copy(hessian_.begin(), hessian_.end(), factor_.begin());
  step_.assign(size_, 0.0);
  std::size_t side = 0;
  for (std::size_t row = 0; row < first_.size();) {
    row = add_rows_at(row, side);
  }
  hold_fixed(lagrangian_);
  for (const std::size_t i : fixed_) {
    factor_[i * W] += kFixed;
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < size_; ++i) {
    largest = std::max(largest, std::abs(lagrangian_[i]));
    step_[i] -= lagrangian_[i];
  }
  return largest;
}

template <int W>
void ElasticProgram<W>::hold_fixed(std::vector<double>& x) const {
  for (const std::size_t i : fixed_) {
    x[i] = 0.0;
  }
}

template <int W>
bool ElasticProgram<W>::factor() {
  return factor_columns(Width<W>{}, factor_.data(), size_);
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
void ElasticProgram<W>::move(double target, double along, Side& side, double& length) {
  const double room = (target - side.room_product) / side.multiplier - side.room;
  const double breach = (target - side.breach_product) / side.slack - side.breach;
  side.multiplier_step = side.stiffness * (side.sign * along + room - breach);
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
}

template <int W>
double ElasticProgram<W>::predict() {
  hold_fixed(step_);
  back_substitute(step_);
  corrector_.assign(size_, 0.0);
  of_target_.assign(size_, 0.0);
  double length = 1.0 / kOfTheWay;
  for (std::size_t i = 0; i < sides_.size();) {
    const std::size_t row = sides_[i].row;
    const Gradient& g = gradients_[row];
    const double along = product(Width<W>{}, g.data(), step_.data() + first_[row]);
    double force = 0.0;
    double of_target = 0.0;
    for (; i < sides_.size() && sides_[i].row == row; ++i) {
      Side& side = sides_[i];
      side.room_product = side.breach_product = 0.0;
      move(0.0, along, side, length);
      side.room_product = side.multiplier_step * side.room_step;
      side.breach_product = -side.multiplier_step * side.breach_step;
      const double signed_stiffness = side.sign * side.stiffness;
      const double by_multiplier = 1.0 / side.multiplier;
      const double by_slack = 1.0 / side.slack;
      force += signed_stiffness * (side.breach - side.room - side.room_product * by_multiplier +
                                   side.breach_product * by_slack);
      of_target += signed_stiffness * (by_multiplier - by_slack);
    }
    add_to(Width<W>{}, g.data(), -force, corrector_.data() + first_[row]);
    add_to(Width<W>{}, g.data(), -of_target, of_target_.data() + first_[row]);
  }
  return kOfTheWay * length;
}

template <int W>
double ElasticProgram<W>::correct(double target) {
  for (std::size_t i = 0; i < size_; ++i) {
    step_[i] = corrector_[i] + target * of_target_[i] - lagrangian_[i];
  }
  hold_fixed(step_);
  back_substitute(step_);
  double length = 1.0 / kOfTheWay;
  for (std::size_t i = 0; i < sides_.size();) {
    const std::size_t row = sides_[i].row;
    const double along = product(Width<W>{}, gradients_[row].data(), step_.data() + first_[row]);
    for (; i < sides_.size() && sides_[i].row == row; ++i) {
      move(target, along, sides_[i], length);
    }
  }
  return kOfTheWay * length;
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
  const double enough = gap_per_unknown * static_cast<double>(size_);
  for (int iteration = 0; iteration < kMostIterations; ++iteration) {
    const double largest = linearise();
    const double now = gap_after(0.0);
    if (now <= enough && largest <= kStationary && (iteration > 0 || !sides_.empty())) {
      return delta_;
    }
    if (!factor()) {
      return std::nullopt;
    }
    ++iterations;
    const double foreseen = predict();
    if (sides_.empty()) {
      advance(1.0);
      return delta_;
    }
    const double left = gap_after(foreseen) / now;
    const double target = left * left * left * now / (2.0 * static_cast<double>(sides_.size()));
    advance(correct(target));
  }
  return std::nullopt;
}

template <int W>
double ElasticProgram<W>::value_at_solution(std::size_t row) const {
  return values_[row] +
         gradients_[row].dot(Eigen::Map<const Gradient>(delta_.data() + first_[row]));
}

template class ElasticProgram<5>;
template class ElasticProgram<18>;
template class ElasticProgram<24>;
template class ElasticProgram<40>;

}  // namespace unflex::quadratic
