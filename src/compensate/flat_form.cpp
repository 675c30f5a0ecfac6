#include "flat_form.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "stencil_loops.hpp"
#include "unflex/core/pair.hpp"

namespace unflex::compensate {
namespace {

constexpr std::size_t kFewestNodes = 8;
constexpr double kSmallestOmegaH = 0.05;
constexpr std::size_t kMiddle = 2;  // c_{k+2} is where p_k is, roughly

// Rounding errors of the stencils would affect the whole form, so stencils are computed to twice
// the precision.
using math::Pair;
using PairStencil = std::array<Pair, kHalfBand + 1>;
constexpr std::size_t kStates = 5;
using PairMatrix = std::array<std::array<Pair, kStates>, kStates>;

// Coefficients in powers of q from those in powers of s = q − 1.
PairStencil shifted(const PairStencil& in_s) {
  PairStencil result{};
  PairStencil power{{{1.0}}};  // (q − 1)ⁱ
  for (std::size_t i = 0; i <= kHalfBand; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      result[j] = result[j] + in_s[i] * power[j];
    }
    for (std::size_t j = kHalfBand; j > 0; --j) {
      power[j] = power[j - 1] - power[j];
    }
    power[0] = -power[0];
  }
  return result;
}

// growth · m
PairMatrix grown(const ChainMatrix& growth, const PairMatrix& m) {
  PairMatrix result{};
  for (std::size_t i = 0; i < kStates; ++i) {
    for (std::size_t k = 0; k < kStates; ++k) {
      const double factor = growth(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
      for (std::size_t j = 0; factor != 0.0 && j < kStates; ++j) {
        result[i][j] = result[i][j] + Pair{factor} * m[k][j];
      }
    }
  }
  return result;
}

void apply(RowKind kind, const Stencil& stencil, const Padded& x, Padded& y) {
  if (kind == RowKind::jerk) {
    loops::apply<kHalfBand + 1>(stencil, x.data(), y.data(), y.size());
  } else {
    loops::apply<kHalfBand>(stencil, x.data(), y.data(), y.size());
  }
}

}  // namespace

// The polynomials are found in s = q − 1, the eigenvalues of Φ − I: those of Φ lie so close to 1
// that in q the nozzle's coefficients, of size (ωh)², would be differences of numbers about 1.
FlatStencils::FlatStencils(const AxisChain& chain) {
  std::array<PairStencil, kStates> of_states{};
  PairStencil of_jerk{};
  PairMatrix adjugate{};  // N_4, then N_3 …
  for (std::size_t i = 0; i < kStates; ++i) {
    adjugate[i][i] = {1.0};
  }
  of_jerk[5] = {1.0};
  for (std::size_t i = kStates; i-- > 0;) {
    for (std::size_t component = 0; component < kStates; ++component) {
      for (std::size_t j = 0; j < kStates; ++j) {
        of_states[component][i] =
            of_states[component][i] +
            adjugate[component][j] * Pair{chain.input(static_cast<Eigen::Index>(j))};
      }
    }
    adjugate = grown(chain.growth, adjugate);
    // b, ḃ and b̈ are three integrations of the jerk: s³ divides the polynomial.
    if (i >= 3) {
      Pair trace;
      for (std::size_t j = 0; j < kStates; ++j) {
        trace = trace + adjugate[j][j];
      }
      of_jerk[i] = -trace / Pair{static_cast<double>(kStates - i)};
      for (std::size_t j = 0; j < kStates; ++j) {
        adjugate[j][j] = adjugate[j][j] + of_jerk[i];
      }
    }
  }
  const Pair unit = of_states[AxisChain::kNozzle][0];
  const auto put = [&](const PairStencil& from, Stencil& to) {
    const PairStencil in_q = shifted(from);
    for (std::size_t i = 0; i <= kHalfBand; ++i) {
      to[i] = (in_q[i] / unit).high;
    }
  };
  for (std::size_t component = 0; component < kStates; ++component) {
    put(of_states[component], state[component]);
  }
  put(of_jerk, jerk);
  const Stencil& p = state[AxisChain::kNozzle];
  const Stencil& rate = state[AxisChain::kNozzleRate];
  for (std::size_t i = 0; i <= kHalfBand; ++i) {
    const double p_before = i > 0 ? p[i - 1] : 0.0;
    const double rate_before = i > 0 ? rate[i - 1] : 0.0;
    middle[i] = 0.5 * (p[i] + p_before) + 0.125 * (rate[i] - rate_before);
  }
}

const Stencil& FlatStencils::of(RowKind kind) const {
  switch (kind) {
    case RowKind::position:
      return state[AxisChain::kBase];
    case RowKind::velocity:
      return state[AxisChain::kBaseRate];
    case RowKind::accel:
      return state[AxisChain::kBaseAccel];
    default:
      return jerk;
  }
}

bool FlatForm::takes(const AxisWindow& window) {
  return window.models() == 1 && window.axis.mode_count() == 1 && window.freq_shares.empty();
}

bool FlatForm::suits(const ScaledWindow& scaled) {
  const AxisWindow& window = *scaled.window;
  return scaled.nodes >= kFewestNodes &&
         window.axis.main_rad_s() * window.period_s >= kSmallestOmegaH;
}

void FlatForm::assign(const ScaledWindow& scaled) {
  window_ = &scaled;
  faint_pull_ = kFaintPull;
  nodes_ = scaled.nodes;
  const AxisWindow& window = *scaled.window;
  const FlatStencils stencils(
      AxisChain(window.axis.main_rad_s() * window.period_s, window.axis.main_damping_ratio()));
  for (const RowKind kind : kRowKinds) {
    stencils_[index_of(kind)] = stencils.of(kind);
  }
  nozzle_ = stencils.state[AxisChain::kNozzle];
  middle_ = stencils.middle;
  first_ = scaled.start ? 4 : 0;
  last_ = scaled.end_base ? nodes_ + 1 : nodes_ + 3;

  const std::size_t unknowns = nodes_ + 4;
  for (Padded* values : {&c_, &step_, &gradient_, &scratch_}) {
    values->resize(unknowns);
  }
  for (Padded* values : {&at_nodes_.reference, &at_nodes_.weight, &at_nodes_.pull}) {
    values->resize(nodes_);
  }
  for (Padded* values :
       {&at_middles_.reference, &at_middles_.weight, &at_middles_.pull, &jerk_pull_}) {
    values->resize(nodes_ - 1);
  }
  for (std::size_t d = 0; d <= kHalfBand; ++d) {
    cost_hessian_[d].resize(unknowns);
  }
  for (std::size_t k = 0; k < nodes_; ++k) {
    const bool at_end = k == 0 || k + 1 == nodes_;
    at_nodes_.weight[k] = window.weight[2 * k] * (at_end ? 1.0 / 6.0 : 1.0 / 3.0);
  }
  for (std::size_t k = 0; k + 1 < nodes_; ++k) {
    at_middles_.weight[k] = window.weight[2 * k + 1] * (2.0 / 3.0);
  }
  set_aims();
  add_up_cost();

  for (std::size_t i = 0; i < unknowns; ++i) {
    const std::size_t k = std::clamp(i, kMiddle, nodes_ + 1) - kMiddle;
    c_[i] = scaled.aim(0)[2 * k];
  }
  find_ends();
}

void FlatForm::set_aims() {
  for (std::size_t k = 0; k < nodes_; ++k) {
    at_nodes_.reference[k] = window_->aim(0)[2 * k];
  }
  for (std::size_t k = 0; k + 1 < nodes_; ++k) {
    at_middles_.reference[k] = window_->aim(0)[2 * k + 1];
  }
}

// Finds what keeps the fixed ends, and sets the first guess there.
void FlatForm::find_ends() {
  const Stencil& position = stencils_[index_of(RowKind::position)];
  const Stencil& velocity = stencils_[index_of(RowKind::velocity)];
  if (window_->start) {
    const AxisWindow& window = *window_->window;
    const FlatStencils stencils(
        AxisChain(window.axis.main_rad_s() * window.period_s, window.axis.main_damping_ratio()));
    ChainMatrix to_state;
    for (Eigen::Index component = 0; component < 5; ++component) {
      for (Eigen::Index i = 0; i < 5; ++i) {
        to_state(component, i) =
            stencils.state[static_cast<std::size_t>(component)][static_cast<std::size_t>(i)];
      }
    }
    const Eigen::FullPivLU<ChainMatrix> solver(to_state);
    ChainVector given;
    given << *window_->start, 0.0;
    start_direction_ = solver.solve(ChainVector(ChainVector::Unit(4)));
    start_direction_ /= start_direction_.lpNorm<Eigen::Infinity>();
    const ChainVector offset = solver.solve(given);
    Eigen::Map<ChainVector>(c_.data()) = offset;
  }
  if (window_->end_base) {
    Eigen::Matrix2d last;
    last << position[3], position[4], velocity[3], velocity[4];
    Eigen::Matrix<double, 2, 3> before;
    before << position[0], position[1], position[2], velocity[0], velocity[1], velocity[2];
    const Eigen::Matrix2d inverse = last.inverse();
    end_from_ = -inverse * before;
    Eigen::Map<Eigen::Vector2d>(c_.data() + nodes_ + 2) =
        inverse.col(0) * *window_->end_base +
        end_from_ * Eigen::Map<const Eigen::Vector3d>(c_.data() + nodes_ - 1);
  }
}

void FlatForm::add_up_cost() {
  // The jerk's weight is equal everywhere, so its part is one number per diagonal. The first and
  // last rows differ, because not all of its stencils reach them.
  const Stencil& jerk = stencils_[index_of(RowKind::jerk)];
  const std::size_t unknowns = nodes_ + 4;
  for (std::size_t d = 0; d <= kHalfBand; ++d) {
    Padded& diagonal = cost_hessian_[d];
    double sum = 0.0;
    for (std::size_t i = 0; i + d <= kHalfBand; ++i) {
      sum += jerk[i] * jerk[i + d];
    }
    std::fill_n(diagonal.data(), unknowns, window_->jerk_weight * sum);
    for (std::size_t r = 0; r < unknowns; ++r) {
      if (r == kHalfBand && unknowns > 2 * kHalfBand) {
        r = unknowns - kHalfBand;
      }
      double part = 0.0;
      for (std::size_t i = 0; i + d <= kHalfBand && i <= r; ++i) {
        part += r - i + 1 < nodes_ ? jerk[i] * jerk[i + d] : 0.0;
      }
      diagonal[r] = window_->jerk_weight * part;
    }
  }
  loops::add_squares<kHalfBand>(nozzle_, at_nodes_.weight.data(), cost_hessian_, unknowns);
  loops::add_squares<kHalfBand + 1>(middle_, at_middles_.weight.data(), cost_hessian_, unknowns);
}

void FlatForm::evaluate(const PerKind<bool>& kinds) {
  const auto pull = [&](const Padded& reference, const Padded& weight, Padded& result) {
    const auto error = as_array(result) - as_array(reference);
    half_cost_ += 0.5 * (as_array(weight) * error.square()).sum();
    as_array(result) = as_array(weight) * error;
  };
  half_cost_ = 0.0;
  loops::apply<kHalfBand>(nozzle_, c_.data(), at_nodes_.pull.data(), nodes_);
  pull(at_nodes_.reference, at_nodes_.weight, at_nodes_.pull);
  loops::apply<kHalfBand + 1>(middle_, c_.data(), at_middles_.pull.data(), nodes_ - 1);
  pull(at_middles_.reference, at_middles_.weight, at_middles_.pull);
  const Stencil& jerk = stencils_[index_of(RowKind::jerk)];
  apply(RowKind::jerk, jerk, c_, jerk_pull_);
  half_cost_ += 0.5 * window_->jerk_weight * as_array(jerk_pull_).square().sum();
  as_array(jerk_pull_) *= window_->jerk_weight;

  as_array(gradient_).setZero();
  const std::size_t unknowns = nodes_ + 4;
  loops::add_transposed<kHalfBand>(nozzle_, at_nodes_.pull.data(), gradient_.data(), unknowns);
  loops::add_transposed<kHalfBand + 1>(middle_, at_middles_.pull.data(), gradient_.data(),
                                       unknowns);
  loops::add_transposed<kHalfBand + 1>(jerk, jerk_pull_.data(), gradient_.data(), unknowns);
  for (const RowKind kind : kRowKinds) {
    if (kinds[index_of(kind)]) {
      Padded& rows = rows_[index_of(kind)];
      rows.resize(row_count(kind, nodes_));
      apply(kind, stencils_[index_of(kind)], c_, rows);
    }
  }
}

double FlatForm::half_cost() const { return half_cost_; }

bool FlatForm::factor(const PerKind<const double*>& weights) {
  const std::size_t unknowns = nodes_ + 4;
  for (std::size_t d = 0; d <= kHalfBand; ++d) {
    hessian_[d] = cost_hessian_[d];
  }
  for (const RowKind kind : kRowKinds) {
    const double* const weight = weights[index_of(kind)];
    if (weight == nullptr) {
      continue;
    }
    if (kind == RowKind::jerk) {
      loops::add_squares<kHalfBand + 1>(stencils_[index_of(kind)], weight, hessian_, unknowns);
    } else {
      loops::add_squares<kHalfBand>(stencils_[index_of(kind)], weight, hessian_, unknowns);
    }
  }
  tie_ends_of_hessian();
  // If weights differ by more than the precision of numbers, rounding may make a pivot negative. A
  // diagonal that is larger by 1e-15 to 1e-12 of itself makes it positive, and steps still lower
  // the cost.
  constexpr int kMostTries = 4;
  constexpr double kFirstShare = 1e-15;
  constexpr double kMore = 10.0;
  bool is_factored = ldlt_.factor(hessian_, first_, last_);
  double share = kFirstShare;
  for (int i = 0; i < kMostTries && !is_factored; ++i) {
    as_array(hessian_[0]) *= 1.0 + share;
    share *= kMore;
    is_factored = ldlt_.factor(hessian_, first_, last_);
  }
  return is_factored;
}

// Turns the Hessian of all of c into the Hessian of the unknowns.
void FlatForm::tie_ends_of_hessian() {
  const auto at = [&](std::size_t i, std::size_t j) {
    const std::size_t d = i < j ? j - i : i - j;
    return d <= kHalfBand ? hessian_[d][std::min(i, j)] : 0.0;
  };
  if (window_->start) {
    Stencil row{};
    for (std::size_t d = 0; d <= kHalfBand; ++d) {
      for (std::size_t i = 0; i < 5; ++i) {
        const double factor = start_direction_(static_cast<Eigen::Index>(i));
        if (d > 0) {
          row[d] += factor * at(i, 4 + d);
        } else {
          for (std::size_t j = 0; j < 5; ++j) {
            row[0] += factor * start_direction_(static_cast<Eigen::Index>(j)) * at(i, j);
          }
        }
      }
    }
    for (std::size_t d = 0; d <= kHalfBand; ++d) {
      hessian_[d][4] = row[d];
    }
  }
  if (window_->end_base) {
    const std::size_t t = nodes_ - 1;
    Eigen::Matrix<double, 5, 3> tie;
    tie << Eigen::Matrix3d::Identity(), end_from_;
    Eigen::Matrix<double, 2, 5> coupling;  // between c_{t−2}, c_{t−1} and c_t … c_{t+4}
    Eigen::Matrix<double, 5, 5> block;
    for (Eigen::Index j = 0; j < 5; ++j) {
      const std::size_t column = t + static_cast<std::size_t>(j);
      coupling(0, j) = at(t - 2, column);
      coupling(1, j) = at(t - 1, column);
      for (Eigen::Index i = 0; i < 5; ++i) {
        block(i, j) = at(t + static_cast<std::size_t>(i), column);
      }
    }
    const Eigen::Matrix<double, 2, 3> tied_coupling = coupling * tie;
    const Eigen::Matrix3d tied = tie.transpose() * block * tie;
    for (std::size_t j = 0; j < 3; ++j) {
      const auto column = static_cast<Eigen::Index>(j);
      hessian_[j + 2][t - 2] = tied_coupling(0, column);
      hessian_[j + 1][t - 1] = tied_coupling(1, column);
      for (std::size_t i = 0; i <= j; ++i) {
        hessian_[j - i][t + i] = tied(static_cast<Eigen::Index>(i), column);
      }
    }
  }
}

void FlatForm::solve(const PerKind<const double*>& forces) {
  const std::size_t unknowns = nodes_ + 4;
  Padded& right = scratch_;
  faint_pull_ = -faint_pull_;
  as_array(right) = faint_pull_ - as_array(gradient_);
  for (const RowKind kind : kRowKinds) {
    const double* const force = forces[index_of(kind)];
    if (force == nullptr) {
      continue;
    }
    if (kind == RowKind::jerk) {
      loops::add_transposed<kHalfBand + 1>(stencils_[index_of(kind)], force, right.data(),
                                           unknowns);
    } else {
      loops::add_transposed<kHalfBand>(stencils_[index_of(kind)], force, right.data(), unknowns);
    }
  }
  const std::size_t t = nodes_ - 1;
  if (window_->start) {
    right[4] = start_direction_.dot(Eigen::Map<const ChainVector>(right.data()));
  }
  if (window_->end_base) {
    Eigen::Map<Eigen::Vector3d>(right.data() + t) +=
        end_from_.transpose() * Eigen::Map<const Eigen::Vector2d>(right.data() + t + 3);
  }
  const auto size = static_cast<Eigen::Index>(last_ - first_ + 1);
  const Eigen::Map<const Eigen::VectorXd> force(right.data() + first_, size);
  Eigen::Map<Eigen::VectorXd> step(step_.data() + first_, size);
  step = force;
  ldlt_.solve(step_.data());
  decrement_ = 0.5 * force.dot(step);
  if (window_->start) {
    Eigen::Map<ChainVector>(step_.data()) = start_direction_ * double(step_[4]);
  }
  if (window_->end_base) {
    Eigen::Map<Eigen::Vector2d>(step_.data() + t + 3) =
        end_from_ * Eigen::Map<const Eigen::Vector3d>(step_.data() + t);
  }
  for (const RowKind kind : kRowKinds) {
    if (forces[index_of(kind)] != nullptr) {
      Padded& steps = row_steps_[index_of(kind)];
      steps.resize(row_count(kind, nodes_));
      apply(kind, stencils_[index_of(kind)], step_, steps);
    }
  }
}

void FlatForm::advance(double length) { as_array(c_) += length * as_array(step_); }

void FlatForm::write(dynamics::AxisTrajectory& base) {
  const auto put = [&](RowKind kind, double offset, std::vector<double>& to) {
    Padded& rows = rows_[index_of(kind)];
    rows.resize(nodes_);
    apply(kind, stencils_[index_of(kind)], c_, rows);
    to.resize(nodes_);
    Eigen::Map<Eigen::ArrayXd>(to.data(), static_cast<Eigen::Index>(nodes_)) =
        offset + window_->unit[index_of(kind)] * as_array(rows);
  };
  put(RowKind::position, window_->origin_mm, base.position_mm);
  put(RowKind::velocity, 0.0, base.velocity_mm_s);
  put(RowKind::accel, 0.0, base.accel_mm_s2);
  window_->keep_ends(base);
}

void FlatForm::write_nozzles(std::vector<std::vector<double>>& nozzles_mm) {
  nozzles_mm.assign(1, std::vector<double>(nodes_));
  loops::apply<kHalfBand>(nozzle_, c_.data(), at_nodes_.pull.data(), nodes_);
  for (std::size_t k = 0; k < nodes_; ++k) {
    nozzles_mm[0][k] = window_->origin_mm + window_->unit[0] * at_nodes_.pull[k];
  }
}

}  // namespace unflex::compensate
