#include "stage_form.hpp"

#include <algorithm>
#include <array>

namespace unflex::compensate {
namespace {

// b' = b + ḃ + b̈/2 + j/6 and so on.
constexpr std::array<double, 3> kBaseByJerk = {1.0 / 6.0, 0.5, 1.0};

// From b, ḃ and b̈ one interval before the base rests: the place where it will rest, and what the
// input of the interval before does to it.
constexpr std::array<double, 3> kRestingSoon = {1.0, 2.0 / 3.0, 1.0 / 6.0};
constexpr double kRestingSoonByJerk = 1.0 / 6.0 + 0.5 * 2.0 / 3.0 + 1.0 / 6.0;

}  // namespace

void ModeSteps::clear() {
  for (std::vector<double>& part : own) {
    part.clear();
  }
  for (std::array<std::vector<double>, 2>* of : {&by_accel, &by_jerk}) {
    for (std::vector<double>& part : *of) {
      part.clear();
    }
  }
}

void ModeSteps::add(const dynamics::Mode& mode, double period_s) {
  const AxisChain chain(mode, period_s);
  const ChainMatrix& growth = chain.growth;
  own[0].push_back(1.0 + growth(0, 0));
  own[1].push_back(growth(0, 1));
  own[2].push_back(growth(1, 0));
  own[3].push_back(1.0 + growth(1, 1));
  by_accel[0].push_back(mode.gain * (growth(0, 4) - growth(2, 4)));
  by_accel[1].push_back(mode.gain * (growth(1, 4) - growth(3, 4)));
  by_jerk[0].push_back(mode.gain * (chain.input(0) - chain.input(2)));
  by_jerk[1].push_back(mode.gain * (chain.input(1) - chain.input(3)));
}

void StageForm::set_models(const AxisWindow& window) {
  modes_.clear();
  gains_.clear();
  models_.clear();
  model_of_.clear();
  for (std::size_t c = 0; c < window.models(); ++c) {
    const Plant plant = window.model(c);
    Model model;
    model.first_mode = modes_.count();
    for (const dynamics::Mode& mode : plant.axis.modes()) {
      modes_.add(mode, window.period_s);
      gains_.push_back(mode.gain);
    }
    model.end_mode = modes_.count();
    model_of_.resize(modes_.count(), c);
    model.share = plant.share;
    models_.push_back(std::move(model));
  }
  size_ = base() + 3;
  const auto n = static_cast<Eigen::Index>(size_);
  node_square_.setZero(n, n);
  middle_square_.setZero(n, n);
  middle_cross_.setZero(n);
  middle_curvature_ = 0.0;
  accel_column_.setZero(n);
  input_column_.setZero(n);
  for (std::size_t i = 0; i < modes_.count(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const auto rate_at = static_cast<Eigen::Index>(rates() + i);
    accel_column_(at) = modes_.by_accel[0][i];
    accel_column_(rate_at) = modes_.by_accel[1][i];
    input_column_(at) = modes_.by_jerk[0][i];
    input_column_(rate_at) = modes_.by_jerk[1][i];
  }
  accel_column_.tail(3) << 0.5, 1.0, 1.0;
  input_column_.tail(3) << kBaseByJerk[0], kBaseByJerk[1], kBaseByJerk[2];
  middle_of_.resize(base());
  for (Model& model : models_) {
    Vector place = Vector::Zero(n);
    Vector rate = Vector::Zero(n);
    place(static_cast<Eigen::Index>(base())) = 1.0;
    rate(static_cast<Eigen::Index>(base()) + 1) = 1.0;
    for (std::size_t i = model.first_mode; i < model.end_mode; ++i) {
      place(static_cast<Eigen::Index>(i)) = 1.0;
      rate(static_cast<Eigen::Index>(rates() + i)) = 1.0;
    }
    // p_c = (p₁ + p₂)/2 + (ṗ₁ − ṗ₂)/8.
    Vector after = 0.5 * place - 0.125 * rate;
    model.middle_input = by_input(after.data());
    transpose_step(after.data());
    model.middle = 0.5 * place + 0.125 * rate + after;
    for (std::size_t i = model.first_mode; i < model.end_mode; ++i) {
      for (const std::size_t at : {i, rates() + i}) {
        middle_of_[at] = model.middle(static_cast<Eigen::Index>(at));
      }
    }
    node_square_ += model.share * place * place.transpose();
    middle_square_ += model.share * model.middle * model.middle.transpose();
    middle_cross_ += model.share * model.middle_input * model.middle;
    middle_curvature_ += model.share * model.middle_input * model.middle_input;
  }
}

void StageForm::assign(const ScaledWindow& scaled) {
  window_ = &scaled;
  faint_pull_ = kFaintPull;
  nodes_ = scaled.nodes;
  const AxisWindow& window = *scaled.window;
  set_models(window);
  const auto n = static_cast<Eigen::Index>(size_);
  states_.resize(nodes_ * size_);
  state_steps_.resize(nodes_ * size_);
  feedback_.resize((nodes_ - 1) * size_);
  node_pull_.resize(nodes_ * models_.size());
  middle_pull_.resize((nodes_ - 1) * models_.size());
  for (Padded* values :
       {&inputs_, &input_steps_, &feedforward_, &middle_weight_, &inverse_curvature_}) {
    values->resize(nodes_ - 1);
  }
  node_weight_.resize(nodes_);
  for (Matrix* matrix : {&cost_to_go_, &next_}) {
    matrix->setZero(n, n);
  }
  for (Vector* vector : {&by_input_, &by_accel_, &cross_, &pivot_row_}) {
    vector->resize(n);
  }
  for (std::vector<double>& row : in_rows_) {
    row.resize(modes_.count());
  }
  for (std::size_t k = 0; k < nodes_; ++k) {
    const bool at_end = k == 0 || k + 1 == nodes_;
    node_weight_[k] = window.weight[2 * k] * (at_end ? 1.0 / 6.0 : 1.0 / 3.0);
  }
  for (std::size_t k = 0; k + 1 < nodes_; ++k) {
    middle_weight_[k] = window.weight[2 * k + 1] * (2.0 / 3.0);
  }
  set_start();
}

// Goes from the given start, or from rest at the first reference point, without any jerk until the
// end asks for it.
void StageForm::set_start() {
  const AxisWindow& window = *window_->window;
  const auto n = static_cast<Eigen::Index>(size_);
  const auto accel = static_cast<Eigen::Index>(place(RowKind::accel));
  Vector first = Vector::Zero(n);
  if (window.start) {
    const double b = window_->to_scaled_position(window.start->base_mm);
    first(accel - 2) = b;
    for (std::size_t c = 0; c < models_.size(); ++c) {
      const dynamics::NozzleState nozzle =
          window.in_model(c, window.start->nozzle, window.start->base_mm);
      for (std::size_t i = models_[c].first_mode; i < models_[c].end_mode; ++i) {
        const dynamics::NozzleMotion& part = nozzle.parts[i - models_[c].first_mode];
        first(static_cast<Eigen::Index>(i)) =
            (part.position - gains_[i] * window.start->base_mm) / window_->unit[0];
        first(static_cast<Eigen::Index>(rates() + i)) = part.velocity / window_->unit[1];
      }
    }
    start_basis_.setZero(n, 1);
    start_basis_(accel, 0) = 1.0;
  } else {
    start_basis_.setIdentity(n, n);
  }
  if (window_->end_base && nodes_ == 2) {
    // The only input cannot keep both b and ḃ. So b̈ at the first node is tied to the rest of that
    // state.
    first(accel) = 6.0 * (*window_->end_base - first(accel - 2)) - 4.0 * first(accel - 1);
    if (window_->start) {
      start_basis_.resize(n, 0);
    } else {
      start_basis_.setIdentity(n, n - 1);
      start_basis_(accel, accel - 2) = -6.0;
      start_basis_(accel, accel - 1) = -4.0;
    }
  }
  roll_out(first);
}

void StageForm::roll_out(const Vector& first) {
  std::ranges::copy(first, states_.begin());
  std::vector<double> feedback(size_);
  for (std::size_t k = 0; k + 1 < nodes_; ++k) {
    const double* const z = state(states_, k);
    double input = 0.0;
    if (prescribed(k)) {
      set_prescribed_feedback(k, feedback.data());
      for (std::size_t i = base(); i < size_; ++i) {
        input += feedback[i] * z[i];
      }
      if (k + 3 == nodes_) {
        input += *window_->end_base / kRestingSoonByJerk;
      }
    }
    inputs_[k] = input;
    step(z, input, state(states_, k + 1));
  }
}

void StageForm::step(const double* z, double input, double* next) const {
  const std::size_t count = modes_.count();
  const double* const rate = z + count;
  const double* const b = z + base();
  for (std::size_t i = 0; i < count; ++i) {
    next[i] = modes_.own[0][i] * z[i] + modes_.own[1][i] * rate[i] + modes_.by_accel[0][i] * b[2] +
              modes_.by_jerk[0][i] * input;
    next[count + i] = modes_.own[2][i] * z[i] + modes_.own[3][i] * rate[i] +
                      modes_.by_accel[1][i] * b[2] + modes_.by_jerk[1][i] * input;
  }
  double* const to = next + base();
  to[0] = b[0] + b[1] + 0.5 * b[2] + kBaseByJerk[0] * input;
  to[1] = b[1] + b[2] + kBaseByJerk[1] * input;
  to[2] = b[2] + input;
}

void StageForm::transpose_step(double* v) const {
  const std::size_t count = modes_.count();
  double* const rates = v + count;
  double* const b = v + base();
  double by_accel = 0.5 * b[0] + b[1] + b[2];
  for (std::size_t i = 0; i < count; ++i) {
    const double y = v[i];
    const double rate = rates[i];
    by_accel += modes_.by_accel[0][i] * y + modes_.by_accel[1][i] * rate;
    v[i] = modes_.own[0][i] * y + modes_.own[2][i] * rate;
    rates[i] = modes_.own[1][i] * y + modes_.own[3][i] * rate;
  }
  b[1] += b[0];
  b[2] = by_accel;
}

double StageForm::by_input(const double* v) const {
  const std::size_t count = modes_.count();
  const double* const b = v + base();
  // Sums side by side, since each addition has to wait for the one before it.
  double places = kBaseByJerk[0] * b[0] + kBaseByJerk[1] * b[1];
  double rates = kBaseByJerk[2] * b[2];
  for (std::size_t i = 0; i < count; ++i) {
    places += modes_.by_jerk[0][i] * v[i];
    rates += modes_.by_jerk[1][i] * v[count + i];
  }
  return places + rates;
}

double StageForm::by_feedback(std::size_t k, const double* z) const {
  const std::size_t count = modes_.count();
  const double* const feedback = state(feedback_, k);
  const double* const b = feedback + base();
  double places = b[0] * z[base()] + b[1] * z[base() + 1];
  double rates = b[2] * z[base() + 2];
  for (std::size_t i = 0; i < count; ++i) {
    places += feedback[i] * z[i];
    rates += feedback[count + i] * z[count + i];
  }
  return places + rates;
}

double StageForm::swing(const Model& model, const double* z, std::size_t rate) const {
  const double* const of = z + rate * modes_.count();
  double sum = 0.0;
  for (std::size_t i = model.first_mode; i < model.end_mode; ++i) {
    sum += of[i];
  }
  return sum;
}

void StageForm::evaluate(const PerKind<bool>& kinds) {
  half_cost_ = 0.0;
  const std::size_t count = models_.size();
  for (std::size_t k = 0; k < nodes_; ++k) {
    const double* const z = state(states_, k);
    const double* const next = k + 1 < nodes_ ? state(states_, k + 1) : nullptr;
    for (std::size_t c = 0; c < count; ++c) {
      const Model& model = models_[c];
      const double p = z[base()] + swing(model, z);
      const std::vector<double>& aim = window_->aim(c);
      const double error = p - aim[2 * k];
      const double pull = node_weight_[k] * model.share * error;
      node_pull_[k * count + c] = pull;
      half_cost_ += 0.5 * pull * error;
      if (next != nullptr) {
        const double rate = z[base() + 1] + swing(model, z, 1);
        const double p_next = next[base()] + swing(model, next);
        const double rate_next = next[base() + 1] + swing(model, next, 1);
        const double middle_error =
            0.5 * (p + p_next) + 0.125 * (rate - rate_next) - aim[2 * k + 1];
        const double middle_pull = middle_weight_[k] * model.share * middle_error;
        middle_pull_[k * count + c] = middle_pull;
        half_cost_ += 0.5 * middle_pull * middle_error;
      }
    }
    if (next != nullptr) {
      half_cost_ += 0.5 * window_->jerk_weight * inputs_[k] * inputs_[k];
    }
  }
  split_rows(states_, inputs_, kinds, rows_);
}

void StageForm::split_rows(const std::vector<double>& states, const Padded& inputs,
                           const PerKind<bool>& kinds, PerKind<Padded>& rows) const {
  for (const RowKind kind : kNodeKinds) {
    if (kinds[index_of(kind)]) {
      Padded& row = rows[index_of(kind)];
      row.resize(nodes_);
      for (std::size_t k = 0; k < nodes_; ++k) {
        row[k] = state(states, k)[place(kind)];
      }
    }
  }
  if (kinds[index_of(RowKind::jerk)]) {
    rows[index_of(RowKind::jerk)] = inputs;
  }
}

ProblemSize StageForm::size() const {
  const std::size_t at_end = window_->end_base ? 2 : 0;
  const std::size_t at_start = size_ - static_cast<std::size_t>(start_basis_.cols());
  return {nodes_ * size_ + nodes_ - 1, (nodes_ - 1) * size_ + at_start + at_end};
}

bool StageForm::prescribed(std::size_t k) const {
  return window_->end_base.has_value() && k + 3 >= nodes_;
}

void StageForm::set_prescribed_feedback(std::size_t k, double* feedback) const {
  std::fill_n(feedback, size_, 0.0);
  double* const b = feedback + base();
  if (k + 2 == nodes_) {
    b[1] = b[2] = -2.0;
    return;
  }
  std::ranges::copy(kRestingSoon, b);
  transpose_step(feedback);
  for (std::size_t i = 0; i < size_; ++i) {
    feedback[i] /= -kRestingSoonByJerk;
  }
}

// What the node adds to the slope of the cost of what is still to come.
void StageForm::add_node(std::size_t k, const PerKind<const double*>& forces, double* g) const {
  const double* const pull = node_pull_.data() + k * models_.size();
  for (std::size_t i = 0; i < modes_.count(); ++i) {
    g[i] += pull[model_of_[i]] - faint_pull_;
  }
  for (std::size_t c = 0; c < models_.size(); ++c) {
    g[base()] += pull[c] - faint_pull_;
  }
  for (const RowKind kind : kNodeKinds) {
    if (forces[index_of(kind)] != nullptr) {
      g[place(kind)] -= forces[index_of(kind)][k];
    }
  }
}

// Takes the slope from behind an interval to before it, and sets the interval's feedforward.
void StageForm::carry_slope_back(std::size_t k, const PerKind<const double*>& forces, double* g) {
  const std::size_t count = modes_.count();
  const double* const pull = middle_pull_.data() + k * models_.size();
  const double* const jerk_force = forces[index_of(RowKind::jerk)];
  double slope = window_->jerk_weight * inputs_[k] - (jerk_force != nullptr ? jerk_force[k] : 0.0) +
                 by_input(g);
  for (std::size_t c = 0; c < models_.size(); ++c) {
    slope += pull[c] * models_[c].middle_input;
  }
  feedforward_[k] = -slope * inverse_curvature_[k];
  decrement_ -= 0.5 * slope * feedforward_[k];
  transpose_step(g);
  // A model's place in the middle hangs on its own modes and on the base.
  for (std::size_t i = 0; i < count; ++i) {
    g[i] += pull[model_of_[i]] * middle_of_[i];
    g[count + i] += pull[model_of_[i]] * middle_of_[count + i];
  }
  for (std::size_t c = 0; c < models_.size(); ++c) {
    const double* const middle = models_[c].middle.data() + base();
    for (std::size_t i = 0; i < 3; ++i) {
      g[base() + i] += pull[c] * middle[i];
    }
  }
  const double* const feedback = state(feedback_, k);
  for (std::size_t i = 0; i < size_; ++i) {
    g[i] += slope * feedback[i];
  }
}

void StageForm::solve(const PerKind<const double*>& forces) {
  faint_pull_ = -faint_pull_;
  PerKind<bool> kinds{};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    kinds[i] = forces[i] != nullptr;
  }
  const auto n = static_cast<Eigen::Index>(size_);
  // The model's decrease is ½ Σ r²/R over the inputs, plus such a term for the start.
  decrement_ = 0.0;
  Vector g = Vector::Zero(n);
  add_node(nodes_ - 1, forces, g.data());
  for (std::size_t k = nodes_ - 1; k-- > 0;) {
    carry_slope_back(k, forces, g.data());
    add_node(k, forces, g.data());
  }
  const Vector at_start = start_basis_.transpose() * g;
  const Vector first = -start_inverse_ * at_start;
  decrement_ -= 0.5 * first.dot(at_start);
  Eigen::Map<Vector>(state_steps_.data(), n) = start_basis_ * first;
  for (std::size_t k = 0; k + 1 < nodes_; ++k) {
    const double* const z = state(state_steps_, k);
    input_steps_[k] = by_feedback(k, z) + feedforward_[k];
    step(z, input_steps_[k], state(state_steps_, k + 1));
  }
  split_rows(state_steps_, input_steps_, kinds, row_steps_);
}

void StageForm::advance(double length) {
  const auto size = static_cast<Eigen::Index>(states_.size());
  Eigen::Map<Vector>(states_.data(), size) +=
      length * Eigen::Map<const Vector>(state_steps_.data(), size);
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

void StageForm::write_nozzles(std::vector<std::vector<double>>& nozzles_mm) const {
  nozzles_mm.resize(models_.size());
  for (std::size_t c = 0; c < models_.size(); ++c) {
    nozzles_mm[c].resize(nodes_);
    for (std::size_t k = 0; k < nodes_; ++k) {
      const double* const z = state(states_, k);
      nozzles_mm[c][k] = window_->origin_mm + window_->unit[0] * (z[base()] + swing(models_[c], z));
    }
  }
}

void StageForm::write(dynamics::AxisTrajectory& base) const {
  const auto put = [&](RowKind kind, double offset, std::vector<double>& to) {
    to.resize(nodes_);
    for (std::size_t k = 0; k < nodes_; ++k) {
      to[k] = offset + window_->unit[index_of(kind)] * state(states_, k)[place(kind)];
    }
  };
  put(RowKind::position, window_->origin_mm, base.position_mm);
  put(RowKind::velocity, 0.0, base.velocity_mm_s);
  put(RowKind::accel, 0.0, base.accel_mm_s2);
  window_->keep_ends(base);
}

}  // namespace unflex::compensate
