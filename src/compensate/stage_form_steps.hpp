// How StageForm does what stage_form.hpp says. Each number of models is compiled in a source of its
// own (stage_form_one.cpp …), because it takes the compiler long.
#pragma once

#include <Eigen/Cholesky>
#include <array>

#include "stage_form.hpp"

namespace unflex::compensate {

// The kinds with a row at every node. Each row is a component of z.
inline constexpr std::array<RowKind, 3> kNodeKinds = {RowKind::position, RowKind::velocity,
                                                      RowKind::accel};

// From b, ḃ and b̈ one interval before the base rests: the place where it will rest.
template <int kModels>
typename StageForm<kModels>::State StageForm<kModels>::resting_soon() {
  State row = State::Zero();
  row(kBase) = 1.0;
  row(kBaseRate) = 2.0 / 3.0;
  row(kBaseAccel) = 1.0 / 6.0;
  return row;
}

template <int kModels>
void StageForm<kModels>::assign(const ScaledWindow& scaled) {
  window_ = &scaled;
  faint_pull_ = kFaintPull;
  nodes_ = scaled.nodes;
  const AxisWindow& window = *scaled.window;
  Square growth = Square::Zero();
  for (std::size_t i = 0; i < kModels; ++i) {
    const AxisVariant model = window.model(i);
    share_(static_cast<Eigen::Index>(i)) = model.share;
    const AxisChain chain(model.axis.main(), window.period_s);
    const Eigen::Index p = nozzle(i);
    growth.template block<2, 2>(p, p) = chain.growth.topLeftCorner<2, 2>();
    growth.template block<2, 3>(p, kBase) = chain.growth.topRightCorner<2, 3>();
    input_.template segment<2>(p) = chain.input.head<2>();
    // All models have the base in common.
    growth.template block<3, 3>(kBase, kBase) = chain.growth.bottomRightCorner<3, 3>();
    input_.template segment<3>(kBase) = chain.input.tail<3>();
  }
  transition_ = Square::Identity() + growth;
  // p_c = (p₁ + p₂)/2 + (ṗ₁ − ṗ₂)/8.
  for (std::size_t i = 0; i < kModels; ++i) {
    State after = State::Zero();
    after(nozzle(i)) = 0.5;
    after(nozzle(i) + 1) = -0.125;
    State before = after;
    before(nozzle(i) + 1) = 0.125;
    const auto column = static_cast<Eigen::Index>(i);
    middle_.col(column) = before + transition_.transpose() * after;
    middle_input_(column) = after.dot(input_);
  }

  states_.resize(nodes_);
  state_steps_.resize(nodes_);
  stages_.resize(nodes_ - 1);
  node_weight_.resize(nodes_);
  node_pull_.resize(nodes_);
  middle_pull_.resize(nodes_ - 1);
  for (Padded* values : {&inputs_, &input_steps_, &feedforward_, &middle_weight_}) {
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

template <int kModels>
bool StageForm<kModels>::prescribed(std::size_t k) const {
  return window_->end_base.has_value() && k + 3 >= nodes_;
}

template <int kModels>
typename StageForm<kModels>::State StageForm<kModels>::prescribed_feedback(std::size_t k) const {
  State feedback = State::Zero();
  if (k + 2 == nodes_) {
    feedback(kBaseRate) = feedback(kBaseAccel) = -2.0;
  } else {
    const State row = resting_soon();
    feedback = -transition_.transpose() * row / row.dot(input_);
  }
  return feedback;
}

// Goes from the given start, or from rest at the first reference point, without any jerk until the
// end asks for it.
template <int kModels>
void StageForm<kModels>::first_guess() {
  const bool two_nodes_to_rest = window_->end_base && nodes_ == 2;
  State first = State::Zero();
  if (window_->start) {
    for (std::size_t i = 0; i < kModels; ++i) {
      first.template segment<2>(nozzle(i)) = window_->start->template head<2>();
    }
    first.template segment<2>(kBase) = window_->start->template tail<2>();
    start_basis_ = State::Unit(kBaseAccel);
  } else {
    start_basis_ = Square::Identity();
  }
  if (two_nodes_to_rest) {
    // The only input cannot keep both b and ḃ. So b̈ at the first node is tied to the rest of that
    // state.
    const auto tie = [&](auto&& state, double target) {
      state(kBaseAccel) = 6.0 * (target - state(kBase)) - 4.0 * state(kBaseRate);
    };
    tie(first, *window_->end_base);
    if (window_->start) {
      start_basis_.resize(kStates, 0);
    } else {
      start_basis_ = Square::Identity().template leftCols<kStates - 1>();
      for (Eigen::Index i = 0; i + 1 < kStates; ++i) {
        tie(start_basis_.col(i), 0.0);
      }
    }
  }
  roll_out(first);
}

template <int kModels>
void StageForm<kModels>::roll_out(const State& first) {
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

template <int kModels>
typename StageForm<kModels>::PerModel StageForm<kModels>::errors(std::size_t k) const {
  PerModel result;
  for (std::size_t i = 0; i < kModels; ++i) {
    result(static_cast<Eigen::Index>(i)) = states_[k](nozzle(i)) - window_->reference[2 * k];
  }
  return result;
}

template <int kModels>
typename StageForm<kModels>::PerModel StageForm<kModels>::middle_errors(std::size_t k) const {
  const State& z = states_[k];
  const State& next = states_[k + 1];
  PerModel result;
  for (std::size_t i = 0; i < kModels; ++i) {
    const Eigen::Index p = nozzle(i);
    result(static_cast<Eigen::Index>(i)) =
        0.5 * (z(p) + next(p)) + 0.125 * (z(p + 1) - next(p + 1)) - window_->reference[2 * k + 1];
  }
  return result;
}

template <int kModels>
void StageForm<kModels>::evaluate(const PerKind<bool>& kinds) {
  half_cost_ = 0.0;
  for (std::size_t k = 0; k < nodes_; ++k) {
    const PerModel error = errors(k);
    node_pull_[k] = node_weight_[k] * share_.cwiseProduct(error);
    half_cost_ += 0.5 * node_pull_[k].dot(error);
    if (k + 1 == nodes_) {
      break;
    }
    const PerModel middle_error = middle_errors(k);
    middle_pull_[k] = middle_weight_[k] * share_.cwiseProduct(middle_error);
    half_cost_ += 0.5 * middle_pull_[k].dot(middle_error) +
                  0.5 * window_->jerk_weight * inputs_[k] * inputs_[k];
  }
  split_rows(states_, inputs_, kinds, rows_);
}

template <int kModels>
void StageForm<kModels>::split_rows(const std::vector<State>& states, const Padded& inputs,
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

template <int kModels>
bool StageForm<kModels>::factor(const PerKind<const double*>& weights) {
  const auto add_node = [&](std::size_t k, Square& p) {
    for (std::size_t i = 0; i < kModels; ++i) {
      p(nozzle(i), nozzle(i)) += share_(static_cast<Eigen::Index>(i)) * node_weight_[k];
    }
    for (const RowKind kind : kNodeKinds) {
      if (weights[index_of(kind)] != nullptr) {
        p(component_of(kind), component_of(kind)) += weights[index_of(kind)][k];
      }
    }
  };
  const double* const jerk_weight = weights[index_of(RowKind::jerk)];
  Square p = Square::Zero();
  add_node(nodes_ - 1, p);
  for (std::size_t k = nodes_ - 1; k-- > 0;) {
    const State by_input = p * input_;
    const Square by_state = p * transition_;
    const Middles weighted_middle = middle_weight_[k] * middle_ * share_.asDiagonal();
    const double curvature =
        window_->jerk_weight + (jerk_weight != nullptr ? jerk_weight[k] : 0.0) +
        input_.dot(by_input) +
        middle_weight_[k] * middle_input_.dot(share_.cwiseProduct(middle_input_));
    const State cross = transition_.transpose() * by_input + weighted_middle * middle_input_;
    if (!(curvature > 0.0)) {
      return false;
    }
    Stage& stage = stages_[k];
    Square next = transition_.transpose() * by_state + weighted_middle * middle_.transpose();
    if (prescribed(k)) {
      stage = {prescribed_feedback(k), 0.0};
      const State half = cross + 0.5 * curvature * stage.feedback;
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

template <int kModels>
bool StageForm<kModels>::factor_start(const Square& to_come) {
  const Reduced reduced = start_basis_.transpose() * to_come * start_basis_;
  const Eigen::Index size = reduced.rows();
  const Eigen::LLT<Reduced> llt(reduced);
  start_inverse_ = Eigen::MatrixXd::Identity(size, size);
  if (size > 0) {
    if (llt.info() != Eigen::Success) {
      return false;
    }
    llt.solveInPlace(start_inverse_);
  }
  return true;
}

template <int kModels>
void StageForm<kModels>::solve(const PerKind<const double*>& forces) {
  faint_pull_ = -faint_pull_;
  PerKind<bool> kinds{};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    kinds[i] = forces[i] != nullptr;
  }
  const auto add_node = [&](std::size_t k, State& g) {
    for (std::size_t i = 0; i < kModels; ++i) {
      g(nozzle(i)) += node_pull_[k](static_cast<Eigen::Index>(i)) - faint_pull_;
    }
    for (const RowKind kind : kNodeKinds) {
      if (forces[index_of(kind)] != nullptr) {
        g(component_of(kind)) -= forces[index_of(kind)][k];
      }
    }
  };
  const double* const jerk_force = forces[index_of(RowKind::jerk)];
  // The model's decrease is ½ Σ r²/R over the inputs, plus such a term for the start.
  decrement_ = 0.0;
  State g = State::Zero();
  add_node(nodes_ - 1, g);
  for (std::size_t k = nodes_ - 1; k-- > 0;) {
    const Stage& stage = stages_[k];
    const double slope = window_->jerk_weight * inputs_[k] -
                         (jerk_force != nullptr ? jerk_force[k] : 0.0) +
                         middle_pull_[k].dot(middle_input_) + input_.dot(g);
    feedforward_[k] = -slope * stage.inverse_curvature;
    decrement_ -= 0.5 * slope * feedforward_[k];
    g = transition_.transpose() * g + middle_ * middle_pull_[k] + slope * stage.feedback;
    add_node(k, g);
  }
  using Free = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kStates, 1>;
  const Free at_start = start_basis_.transpose() * g;
  const Free first = -start_inverse_ * at_start;
  decrement_ -= 0.5 * first.dot(at_start);
  state_steps_[0] = start_basis_ * first;
  for (std::size_t k = 0; k + 1 < nodes_; ++k) {
    input_steps_[k] = stages_[k].feedback.dot(state_steps_[k]) + feedforward_[k];
    state_steps_[k + 1] = transition_ * state_steps_[k] + input_ * input_steps_[k];
  }
  split_rows(state_steps_, input_steps_, kinds, row_steps_);
}

template <int kModels>
void StageForm<kModels>::advance(double length) {
  for (std::size_t k = 0; k < nodes_; ++k) {
    states_[k] += length * state_steps_[k];
  }
  as_array(inputs_) += length * as_array(input_steps_);
}

template <int kModels>
void StageForm<kModels>::save() {
  saved_states_ = states_;
  saved_inputs_ = inputs_;
}

template <int kModels>
void StageForm<kModels>::restore() {
  states_ = saved_states_;
  inputs_ = saved_inputs_;
}

template <int kModels>
void StageForm<kModels>::write(dynamics::AxisTrajectory& base) const {
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
