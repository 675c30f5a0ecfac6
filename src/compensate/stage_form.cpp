#include "stage_form.hpp"

#include <Eigen/Cholesky>

namespace unflex::compensate {
namespace {

// Rows that a weight at a node acts on, and the component of z that each is.
constexpr std::array<RowKind, 3> kNodeKinds = {RowKind::position, RowKind::velocity,
                                               RowKind::accel};

Eigen::Index component_of(RowKind kind) {
  return AxisChain::kBase + static_cast<Eigen::Index>(kind);
}

// Of b, ḃ and b̈ one interval before the base rests at b.
ChainVector resting_soon() {
  ChainVector row = ChainVector::Zero();
  row(AxisChain::kBase) = 1.0;
  row(AxisChain::kBaseRate) = 2.0 / 3.0;
  row(AxisChain::kBaseAccel) = 1.0 / 6.0;
  return row;
}

}  // namespace

void StageForm::assign(const ScaledWindow& scaled) {
  window_ = &scaled;
  faint_pull_ = kFaintPull;
  nodes_ = scaled.nodes;
  const AxisWindow& window = *scaled.window;
  const AxisChain chain(window.axis.omega_rad_s * window.period_s, window.axis.zeta);
  transition_ = ChainMatrix::Identity() + chain.growth;
  input_ = chain.input;
  // p_c = (p₁ + p₂)/2 + (ṗ₁ − ṗ₂)/8.
  ChainVector after = ChainVector::Zero();
  after(AxisChain::kNozzle) = 0.5;
  after(AxisChain::kNozzleRate) = -0.125;
  ChainVector before = after;
  before(AxisChain::kNozzleRate) = 0.125;
  middle_ = before + transition_.transpose() * after;
  middle_input_ = after.dot(input_);

  states_.resize(nodes_);
  state_steps_.resize(nodes_);
  stages_.resize(nodes_ - 1);
  for (Padded* values : {&node_weight_, &node_pull_}) {
    values->resize(nodes_);
  }
  for (Padded* values : {&inputs_, &input_steps_, &feedforward_, &middle_weight_, &middle_pull_}) {
    values->resize(nodes_ - 1);
  }
  for (std::size_t k = 0; k < nodes_; ++k) {
    const bool at_end = k == 0 || k + 1 == nodes_;
    node_weight_[k] = window.weight[2 * k] * (at_end ? 1.0 / 6.0 : 1.0 / 3.0);
  }
  for (std::size_t k = 0; k + 1 < nodes_; ++k) {
    middle_weight_[k] = window.weight[2 * k + 1] * (2.0 / 3.0);
  }
  first_guess();
}

bool StageForm::prescribed(std::size_t k) const {
  return window_->end_base.has_value() && k + 3 >= nodes_;
}

ChainVector StageForm::prescribed_feedback(std::size_t k) const {
  ChainVector feedback = ChainVector::Zero();
  if (k + 2 == nodes_) {
    feedback(AxisChain::kBaseRate) = feedback(AxisChain::kBaseAccel) = -2.0;
  } else {
    const ChainVector row = resting_soon();
    feedback = -transition_.transpose() * row / row.dot(input_);
  }
  return feedback;
}

// From the given start, or from rest at the reference, without any jerk until the end asks for it.
void StageForm::first_guess() {
  const bool two_nodes_to_rest = window_->end_base && nodes_ == 2;
  ChainVector first = ChainVector::Zero();
  if (window_->start) {
    first.head<4>() = *window_->start;
    start_basis_ = ChainVector::Unit(AxisChain::kBaseAccel);
  } else {
    start_basis_ = ChainMatrix::Identity();
  }
  if (two_nodes_to_rest) {
    // The only input cannot keep both b and ḃ: b̈ at the first node is tied to the rest of it.
    const auto tie = [&](auto&& state, double target) {
      state(AxisChain::kBaseAccel) =
          6.0 * (target - state(AxisChain::kBase)) - 4.0 * state(AxisChain::kBaseRate);
    };
    tie(first, *window_->end_base);
    if (window_->start) {
      start_basis_.resize(5, 0);
    } else {
      start_basis_ = ChainMatrix::Identity().leftCols<4>();
      for (Eigen::Index i = 0; i < 4; ++i) {
        tie(start_basis_.col(i), 0.0);
      }
    }
  }
  roll_out(first);
}

void StageForm::roll_out(const ChainVector& first) {
  states_[0] = first;
  for (std::size_t k = 0; k + 1 < nodes_; ++k) {
    double input = 0.0;
    if (prescribed(k)) {
      input = prescribed_feedback(k).dot(states_[k]);
      if (k + 3 == nodes_) {
        input += *window_->end_base / resting_soon().dot(input_);
      }
    }
    inputs_[k] = input;
    states_[k + 1] = transition_ * states_[k] + input_ * input;
  }
}

void StageForm::evaluate(const PerKind<bool>& kinds) {
  half_cost_ = 0.0;
  const std::vector<double>& reference = window_->reference;
  for (std::size_t k = 0; k < nodes_; ++k) {
    const ChainVector& z = states_[k];
    const double error = z(AxisChain::kNozzle) - reference[2 * k];
    node_pull_[k] = node_weight_[k] * error;
    half_cost_ += 0.5 * node_pull_[k] * error;
    if (k + 1 == nodes_) {
      break;
    }
    const ChainVector& next = states_[k + 1];
    const double middle_error = 0.5 * (z(AxisChain::kNozzle) + next(AxisChain::kNozzle)) +
                                0.125 * (z(AxisChain::kNozzleRate) - next(AxisChain::kNozzleRate)) -
                                reference[2 * k + 1];
    middle_pull_[k] = middle_weight_[k] * middle_error;
    half_cost_ +=
        0.5 * middle_pull_[k] * middle_error + 0.5 * window_->jerk_weight * inputs_[k] * inputs_[k];
  }
  split_rows(states_, inputs_, kinds, rows_);
}

void StageForm::split_rows(const std::vector<ChainVector>& states, const Padded& inputs,
                           const PerKind<bool>& kinds, PerKind<Padded>& rows) const {
  for (const RowKind kind : kNodeKinds) {
    if (kinds[index_of(kind)]) {
      Padded& row = rows[index_of(kind)];
      row.resize(nodes_);
      for (std::size_t k = 0; k < nodes_; ++k) {
        row[k] = states[k](component_of(kind));
      }
    }
  }
  if (kinds[index_of(RowKind::jerk)]) {
    rows[index_of(RowKind::jerk)] = inputs;
  }
}

bool StageForm::factor(const PerKind<const double*>& weights) {
  const auto add_node = [&](std::size_t k, ChainMatrix& p) {
    p(AxisChain::kNozzle, AxisChain::kNozzle) += node_weight_[k];
    for (const RowKind kind : kNodeKinds) {
      if (weights[index_of(kind)] != nullptr) {
        p(component_of(kind), component_of(kind)) += weights[index_of(kind)][k];
      }
    }
  };
  const double* const jerk_weight = weights[index_of(RowKind::jerk)];
  ChainMatrix p = ChainMatrix::Zero();
  add_node(nodes_ - 1, p);
  for (std::size_t k = nodes_ - 1; k-- > 0;) {
    const ChainVector by_input = p * input_;
    const ChainMatrix by_state = p * transition_;
    const ChainVector weighted_middle = middle_weight_[k] * middle_;
    const double curvature =
        window_->jerk_weight + (jerk_weight != nullptr ? jerk_weight[k] : 0.0) +
        input_.dot(by_input) + middle_weight_[k] * middle_input_ * middle_input_;
    const ChainVector cross = transition_.transpose() * by_input + weighted_middle * middle_input_;
    if (!(curvature > 0.0)) {
      return false;
    }
    Stage& stage = stages_[k];
    ChainMatrix next = transition_.transpose() * by_state + weighted_middle * middle_.transpose();
    if (prescribed(k)) {
      stage = {prescribed_feedback(k), 0.0};
      const ChainVector half = cross + 0.5 * curvature * stage.feedback;
      next += half * stage.feedback.transpose() + stage.feedback * half.transpose();
    } else {
      stage = {-cross / curvature, 1.0 / curvature};
      next += cross * stage.feedback.transpose();
    }
    p = 0.5 * (next + next.transpose());
    add_node(k, p);
  }
  return factor_start(p);
}

bool StageForm::factor_start(const ChainMatrix& to_come) {
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 5, 5> reduced =
      start_basis_.transpose() * to_come * start_basis_;
  const Eigen::Index size = reduced.rows();
  const Eigen::LLT<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 5, 5>> llt(reduced);
  start_inverse_ = Eigen::MatrixXd::Identity(size, size);
  if (size > 0) {
    if (llt.info() != Eigen::Success) {
      return false;
    }
    llt.solveInPlace(start_inverse_);
  }
  return true;
}

void StageForm::solve(const PerKind<const double*>& forces) {
  faint_pull_ = -faint_pull_;
  PerKind<bool> kinds{};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    kinds[i] = forces[i] != nullptr;
  }
  const auto add_node = [&](std::size_t k, ChainVector& g) {
    g(AxisChain::kNozzle) += node_pull_[k] - faint_pull_;
    for (const RowKind kind : kNodeKinds) {
      if (forces[index_of(kind)] != nullptr) {
        g(component_of(kind)) -= forces[index_of(kind)][k];
      }
    }
  };
  const double* const jerk_force = forces[index_of(RowKind::jerk)];
  // The model's decrease is ½ Σ r²/R over the inputs, and the same for the start.
  decrement_ = 0.0;
  ChainVector g = ChainVector::Zero();
  add_node(nodes_ - 1, g);
  for (std::size_t k = nodes_ - 1; k-- > 0;) {
    const Stage& stage = stages_[k];
    const double slope = window_->jerk_weight * inputs_[k] -
                         (jerk_force != nullptr ? jerk_force[k] : 0.0) +
                         middle_pull_[k] * middle_input_ + input_.dot(g);
    feedforward_[k] = -slope * stage.inverse_curvature;
    decrement_ -= 0.5 * slope * feedforward_[k];
    g = transition_.transpose() * g + middle_pull_[k] * middle_ + slope * stage.feedback;
    add_node(k, g);
  }
  const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 5, 1> at_start = start_basis_.transpose() * g;
  const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 5, 1> first = -start_inverse_ * at_start;
  decrement_ -= 0.5 * first.dot(at_start);
  state_steps_[0] = start_basis_ * first;
  for (std::size_t k = 0; k + 1 < nodes_; ++k) {
    input_steps_[k] = stages_[k].feedback.dot(state_steps_[k]) + feedforward_[k];
    state_steps_[k + 1] = transition_ * state_steps_[k] + input_ * input_steps_[k];
  }
  split_rows(state_steps_, input_steps_, kinds, row_steps_);
}

void StageForm::advance(double length) {
  for (std::size_t k = 0; k < nodes_; ++k) {
    states_[k] += length * state_steps_[k];
  }
  as_array(inputs_) += length * as_array(input_steps_);
}

void StageForm::save() {
  saved_states_ = states_;
  saved_inputs_ = inputs_;
}

void StageForm::restore() {
  states_ = saved_states_;
  inputs_ = saved_inputs_;
}

void StageForm::write(dynamics::AxisTrajectory& base) const {
  const auto put = [&](RowKind kind, double offset, std::vector<double>& to) {
    to.resize(nodes_);
    for (std::size_t k = 0; k < nodes_; ++k) {
      to[k] = offset + window_->unit[index_of(kind)] * states_[k](component_of(kind));
    }
  };
  put(RowKind::position, window_->origin_mm, base.position_mm);
  put(RowKind::velocity, 0.0, base.velocity_mm_s);
  put(RowKind::accel, 0.0, base.accel_mm_s2);
  window_->keep_ends(base);
}

}  // namespace unflex::compensate
