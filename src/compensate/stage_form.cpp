#include "stage_form.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "unflex/core/math.hpp"

namespace unflex::compensate {
std::size_t StageForm::place(std::size_t component) const {
  if (component < count()) {
    return component;
  }
  return component < 2 * count() ? kernel_->mode_places() + component - count()
                                 : kernel_->base_place() + component - 2 * count();
}

void StageForm::set_model(const AxisWindow& window) {
  SharedModes shared = shared_modes(window);
  if (kernel_ == nullptr || shared.modes.size() != shared_.modes.size() ||
      shared.models.size() != shared_.models.size()) {
    kernel_ = make_stage_kernel(shared.modes.size(), shared.models.size());
  }
  shared_ = std::move(shared);
  model_.jerk_weight = window_->jerk_weight;
  model_.models = shared_.models;
  set_steps(window);
  kernel_->assign(model_);
}

// Frequencies that differ by less than kSame share a step. An interval has the frequencies of its
// middle.
void StageForm::set_steps(const AxisWindow& window) {
  constexpr double kSame = 2e-4;
  std::vector<int> by_interval;
  if (!window.freq_shares.empty()) {
    for (std::size_t k = 0; k + 1 < window.nodes(); ++k) {
      by_interval.push_back(
          static_cast<int>(std::lround(math::log(window.freq_shares[2 * k + 1]) / kSame)));
    }
  }
  std::vector<int> different = by_interval.empty() ? std::vector{0} : by_interval;
  std::ranges::sort(different);
  different.erase(std::ranges::unique(different).begin(), different.end());
  model_.step_of.clear();
  for (const int of_interval : by_interval) {
    const auto place = std::ranges::lower_bound(different, of_interval);
    model_.step_of.push_back(static_cast<std::uint32_t>(place - different.begin()));
  }
  model_.steps.resize(different.size());
  for (std::size_t i = 0; i < different.size(); ++i) {
    const double share = different[i] == 0 ? 1.0 : math::exp(kSame * different[i]);
    model_.steps[i].clear();
    for (const SharedModes::Swing& swing : shared_.modes) {
      model_.steps[i].add(share * swing.mode.omega_rad_s * window.period_s, swing.mode.zeta);
    }
  }
}

void StageForm::assign(const ScaledWindow& scaled) {
  window_ = &scaled;
  faint_pull_ = kFaintPull;
  factored_.clear();
  const AxisWindow& window = *scaled.window;
  set_model(window);
  const std::size_t nodes = scaled.nodes;
  arrays_.resize(nodes, kernel_->state_size(), kernel_->model_places());
  arrays_.rests_at_end = scaled.end_base.has_value();
  slope_.resize(kernel_->state_size());
  first_step_.assign(kernel_->state_size(), 0.0);
  for (std::size_t k = 0; k < nodes; ++k) {
    const bool at_end = k == 0 || k + 1 == nodes;
    arrays_.node_weight[k] = window.weight[2 * k] * (at_end ? 1.0 / 6.0 : 1.0 / 3.0);
  }
  for (std::size_t k = 0; k + 1 < nodes; ++k) {
    arrays_.middle_weight[k] = window.weight[2 * k + 1] * (2.0 / 3.0);
  }
  set_aims();
  set_start();
}

void StageForm::set_aims() {
  const AxisWindow& window = *window_->window;
  const std::size_t places = kernel_->model_places();
  for (std::size_t c = 0; c < places; ++c) {
    // A lane that is too many has no weight.
    const std::vector<double>& aim_mm = window.aim_mm(std::min(c, window.models() - 1));
    for (std::size_t k = 0; k < arrays_.nodes; ++k) {
      arrays_.node_aim[k * places + c] = window_->to_scaled_position(aim_mm[2 * k]);
      if (k + 1 < arrays_.nodes) {
        arrays_.middle_aim[k * places + c] = window_->to_scaled_position(aim_mm[2 * k + 1]);
      }
    }
  }
}

// Goes from the given start, or from rest at the first reference point, without any jerk until the
// end asks for it.
void StageForm::set_start() {
  const AxisWindow& window = *window_->window;
  const auto n = static_cast<Eigen::Index>(components());
  const Eigen::Index accel = n - 1;
  Vector first = Vector::Zero(n);
  if (window.start) {
    first(accel - 2) = window_->to_scaled_position(window.start->base_mm);
    for (std::size_t i = 0; i < count(); ++i) {
      first(static_cast<Eigen::Index>(i)) = shared_.modes[i].ahead.position / window_->unit[0];
      first(static_cast<Eigen::Index>(count() + i)) =
          shared_.modes[i].ahead.velocity / window_->unit[1];
    }
    start_basis_.setZero(n, 1);
    start_basis_(accel, 0) = 1.0;
  } else {
    start_basis_.setIdentity(n, n);
  }
  if (window_->end_base && arrays_.nodes == 2) {
    // The only input cannot keep both b and ḃ at the end. So b̈ at the first node follows from b
    // and ḃ there.
    first(accel) = 6.0 * (*window_->end_base - first(accel - 2)) - 4.0 * first(accel - 1);
    if (window_->start) {
      start_basis_.resize(n, 0);
    } else {
      start_basis_.setIdentity(n, n - 1);
      start_basis_(accel, accel - 2) = -6.0;
      start_basis_(accel, accel - 1) = -4.0;
    }
  }
  std::fill_n(arrays_.states.data(), kernel_->state_size(), 0.0);
  for (std::size_t i = 0; i < components(); ++i) {
    arrays_.states[place(i)] = first(static_cast<Eigen::Index>(i));
  }
  kernel_->roll_out(window_->end_base.value_or(0.0), arrays_);
}

bool StageForm::factor(const PerKind<const double*>& weights) {
  const bool has_weights =
      std::ranges::any_of(weights, [](const double* of_kind) { return of_kind != nullptr; });
  if (!has_weights) {
    return kernel_->factor_and_keep(weights, arrays_) && factor_start();
  }
  // Steps by the feedback without weights may be poor ones where limits hold the base for long.
  constexpr int kPatience = 20;
  if (factored_.empty() || ++times_factored_ > kPatience) {
    return kernel_->factor(weights, arrays_) && factor_start();
  }
  // The first stretch comes last, since the start needs its P.
  for (auto range = factored_.rbegin(); range != factored_.rend(); ++range) {
    if (!kernel_->factor_between(range->first, range->last, weights, arrays_)) {
      return false;
    }
  }
  return factored_.front().first > 0 || factor_start();
}

// The number of nodes before a weighted row at which the feedback still differs from the feedback
// without weights.
std::size_t StageForm::lead_nodes() const {
  constexpr double kLead_s = 0.02;
  return static_cast<std::size_t>(kLead_s / window_->window->period_s) + 1;
}

void StageForm::focus(const Stretches& stretches) {
  constexpr std::size_t kKept = StageKernel::kKeptNodes;
  factored_.clear();
  times_factored_ = 0;
  for (const NodeRange& stretch : stretches) {
    const std::size_t first = stretch.first - std::min(stretch.first, lead_nodes());
    const std::size_t last = std::min((stretch.last / kKept + 1) * kKept, arrays_.nodes - 1);
    if (!factored_.empty() && first <= factored_.back().last) {
      factored_.back().last = last;
    } else {
      factored_.push_back({first, last});
    }
  }
}

bool StageForm::factor_start() {
  const auto n = static_cast<Eigen::Index>(components());
  Eigen::MatrixXd cost_to_go(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      cost_to_go(i, j) = kernel_->cost_to_go(place(static_cast<std::size_t>(i)),
                                             place(static_cast<std::size_t>(j)));
    }
  }
  const Eigen::MatrixXd reduced = start_basis_.transpose() * cost_to_go * start_basis_;
  start_inverse_ = Eigen::MatrixXd::Identity(reduced.rows(), reduced.rows());
  if (reduced.rows() > 0) {
    const Eigen::LLT<Eigen::MatrixXd> llt(reduced);
    if (llt.info() != Eigen::Success) {
      return false;
    }
    llt.solveInPlace(start_inverse_);
  }
  return true;
}

void StageForm::set_first_step(const std::vector<double>& slope, double* step) {
  const auto n = static_cast<Eigen::Index>(components());
  Vector g(n);
  for (std::size_t i = 0; i < components(); ++i) {
    g(static_cast<Eigen::Index>(i)) = slope[place(i)];
  }
  const Vector at_start = start_basis_.transpose() * g;
  const Vector first = -start_inverse_ * at_start;
  // The model's decrease is ½ Σ r²/R over the inputs, plus such a term for the start.
  arrays_.decrement -= 0.5 * first.dot(at_start);
  const Vector dz = start_basis_ * first;
  std::fill_n(step, kernel_->state_size(), 0.0);
  for (std::size_t i = 0; i < components(); ++i) {
    step[place(i)] = dz(static_cast<Eigen::Index>(i));
  }
}

void StageForm::evaluate(const PerKind<bool>& kinds) {
  kernel_->evaluate(arrays_);
  split_rows(arrays_.states, arrays_.inputs, kinds, rows_);
}

void StageForm::solve(const PerKind<const double*>& forces) {
  faint_pull_ = -faint_pull_;
  PerKind<bool> kinds{};
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    kinds[i] = forces[i] != nullptr;
  }
  kernel_->carry_slope_back(forces, faint_pull_, true, arrays_, slope_.data());
  set_first_step(slope_, arrays_.state_steps.data());
  kernel_->step_forward(arrays_);
  split_rows(arrays_.state_steps, arrays_.input_steps, kinds, row_steps_);
}

void StageForm::step_to_optimum() {
  faint_pull_ = -faint_pull_;
  kernel_->evaluate(arrays_);
  kernel_->carry_slope_back({}, faint_pull_, true, arrays_, slope_.data());
  set_first_step(slope_, first_step_.data());
  kernel_->go_forward(first_step_.data(), arrays_);
}

void StageForm::follow_aims(const LaneArray& node_aims_mm, const LaneArray& middle_aims_mm) {
  faint_pull_ = -faint_pull_;
  kernel_->change_aims(node_aims_mm.data(), middle_aims_mm.data(), window_->origin_mm,
                       1.0 / window_->unit[0], arrays_);
  kernel_->carry_slope_back({}, faint_pull_, false, arrays_, slope_.data());
  set_first_step(slope_, first_step_.data());
  kernel_->go_forward(first_step_.data(), arrays_);
}

void StageForm::write_nozzles(LaneArray& nozzles_mm) const {
  nozzles_mm.resize(arrays_.nodes * kernel_->model_places());
  kernel_->write_nozzles(window_->origin_mm, window_->unit[0], arrays_, nozzles_mm.data());
}

void StageForm::split_rows(const LaneArray& states, const Padded& inputs,
                           const PerKind<bool>& kinds, PerKind<Padded>& rows) const {
  const std::size_t size = kernel_->state_size();
  for (const RowKind kind : kNodeKinds) {
    if (kinds[index_of(kind)]) {
      Padded& row = rows[index_of(kind)];
      row.resize(arrays_.nodes);
      for (std::size_t k = 0; k < arrays_.nodes; ++k) {
        row[k] = states[k * size + place(kind)];
      }
    }
  }
  if (kinds[index_of(RowKind::jerk)]) {
    rows[index_of(RowKind::jerk)] = inputs;
  }
}

ProblemSize StageForm::size() const {
  const std::size_t n = components();
  const std::size_t at_end = window_->end_base ? 2 : 0;
  const std::size_t at_start = n - static_cast<std::size_t>(start_basis_.cols());
  return {arrays_.nodes * n + arrays_.nodes - 1, (arrays_.nodes - 1) * n + at_start + at_end};
}

void StageForm::advance(double length) {
  const auto size = static_cast<Eigen::Index>(arrays_.states.size());
  Eigen::Map<Vector>(arrays_.states.data(), size) +=
      length * Eigen::Map<const Vector>(arrays_.state_steps.data(), size);
  as_array(arrays_.inputs) += length * as_array(arrays_.input_steps);
}

void StageForm::save() {
  saved_states_.resize(arrays_.states.size());
  std::copy_n(arrays_.states.data(), arrays_.states.size(), saved_states_.data());
  saved_inputs_ = arrays_.inputs;
}

void StageForm::restore() {
  std::copy_n(saved_states_.data(), saved_states_.size(), arrays_.states.data());
  arrays_.inputs = saved_inputs_;
}

void StageForm::write(dynamics::AxisTrajectory& base) const {
  const std::size_t size = kernel_->state_size();
  const auto put = [&](RowKind kind, double offset, std::vector<double>& to) {
    to.resize(arrays_.nodes);
    for (std::size_t k = 0; k < arrays_.nodes; ++k) {
      to[k] = offset + window_->unit[index_of(kind)] * arrays_.states[k * size + place(kind)];
    }
  };
  put(RowKind::position, window_->origin_mm, base.position_mm);
  put(RowKind::velocity, 0.0, base.velocity_mm_s);
  put(RowKind::accel, 0.0, base.accel_mm_s2);
  window_->keep_ends(base);
}

}  // namespace unflex::compensate
