// The factorisation of a window's program, stage by stage from the last one on (stage_form.hpp).
#include <Eigen/Cholesky>
#include <cmath>

#include "stage_form.hpp"
#include "unflex/core/wide_registers.hpp"

namespace unflex::compensate {
namespace {

// Upper triangles of n × n: to += f a + g b.
UNFLEX_WIDE void add_squares(std::size_t n, double f, const double* a, double g, const double* b,
                             double* __restrict to) {
  for (std::size_t r = 0; r < n; ++r) {
    for (std::size_t c = r * n + r; c < (r + 1) * n; ++c) {
      to[c] += f * a[c] + g * b[c];
    }
  }
}

// The upper triangle of n × n: to −= v vᵀ.
UNFLEX_WIDE void take_off_square(std::size_t n, const double* v, double* __restrict to) {
  for (std::size_t r = 0; r < n; ++r) {
    for (std::size_t c = r; c < n; ++c) {
      to[r * n + c] -= v[r] * v[c];
    }
  }
}

}  // namespace

UNFLEX_WIDE void StageForm::carry_back() {
  const std::size_t n = size_;
  const std::size_t count = modes_.count();
  const std::size_t b = base();
  by_accel_.noalias() = cost_to_go_ * accel_column_;
  const double* const u = by_accel_.data();
  const auto& [own_0, own_1, own_2, own_3] = modes_.own;
  for (std::size_t i = 0; i < count; ++i) {
    const double* const of_place = cost_to_go_.data() + i * n;
    const double* const of_rate = cost_to_go_.data() + (count + i) * n;
    double* const place = next_.data() + i * n;
    double* const rate = next_.data() + (count + i) * n;
    // P Φ in these two rows, at the places and at the rates.
    double* const p_p = in_rows_[0].data();
    double* const p_r = in_rows_[1].data();
    double* const r_p = in_rows_[2].data();
    double* const r_r = in_rows_[3].data();
    for (std::size_t j = 0; j < count; ++j) {
      p_r[j] = own_1[j] * of_place[j] + own_3[j] * of_place[count + j];
      r_r[j] = own_1[j] * of_rate[j] + own_3[j] * of_rate[count + j];
    }
    for (std::size_t j = i; j < count; ++j) {
      p_p[j] = own_0[j] * of_place[j] + own_2[j] * of_place[count + j];
      r_p[j] = own_0[j] * of_rate[j] + own_2[j] * of_rate[count + j];
    }
    const double a_0 = own_0[i];
    const double a_1 = own_1[i];
    const double a_2 = own_2[i];
    const double a_3 = own_3[i];
    for (std::size_t j = 0; j < count; ++j) {
      place[count + j] = a_0 * p_r[j] + a_2 * r_r[j];
    }
    for (std::size_t j = i; j < count; ++j) {
      place[j] = a_0 * p_p[j] + a_2 * r_p[j];
      rate[count + j] = a_1 * p_r[j] + a_3 * r_r[j];
    }
    const auto at_base = [&](std::size_t column, double p, double r) {
      place[b + column] = a_0 * p + a_2 * r;
      rate[b + column] = a_1 * p + a_3 * r;
    };
    at_base(0, of_place[b], of_rate[b]);
    at_base(1, of_place[b] + of_place[b + 1], of_rate[b] + of_rate[b + 1]);
    at_base(2, u[i], u[count + i]);
  }
  const double* const p_0 = cost_to_go_.data() + b * n + b;
  const double* const p_1 = p_0 + n;
  double* const to = next_.data() + b * n + b;
  to[0] = p_0[0];
  to[1] = p_0[0] + p_0[1];
  to[2] = u[b];
  to[n + 1] = p_0[0] + 2.0 * p_0[1] + p_1[1];
  to[n + 2] = u[b] + u[b + 1];
  double last = 0.5 * u[b] + u[b + 1] + u[b + 2];
  for (std::size_t i = 0; i < count; ++i) {
    last += modes_.by_accel[0][i] * u[i] + modes_.by_accel[1][i] * u[count + i];
  }
  to[2 * n + 2] = last;
}

bool StageForm::factor(const PerKind<const double*>& weights) {
  const std::size_t n = size_;
  const auto add_rows = [&](std::size_t k, Matrix& p) {
    for (const RowKind kind : kNodeKinds) {
      if (weights[index_of(kind)] != nullptr) {
        const auto at = static_cast<Eigen::Index>(place(kind));
        p(at, at) += weights[index_of(kind)][k];
      }
    }
  };
  const double* const jerk_weight = weights[index_of(RowKind::jerk)];
  cost_to_go_ = node_weight_[nodes_ - 1] * node_square_;
  add_rows(nodes_ - 1, cost_to_go_);
  for (std::size_t k = nodes_ - 1; k-- > 0;) {
    by_input_.noalias() = cost_to_go_ * input_column_;
    const double middle = middle_weight_[k];
    const double curvature = window_->jerk_weight +
                             (jerk_weight != nullptr ? jerk_weight[k] : 0.0) +
                             by_input(by_input_.data()) + middle * middle_curvature_;
    if (!(curvature > 0.0)) {
      return false;
    }
    cross_ = by_input_;
    transpose_step(cross_.data());
    cross_ += middle * middle_cross_;
    carry_back();
    Eigen::Map<Vector> feedback(state(feedback_, k), static_cast<Eigen::Index>(n));
    const double node = node_weight_[k];
    add_squares(n, middle, middle_square_.data(), node, node_square_.data(), next_.data());
    if (prescribed(k)) {
      set_prescribed_feedback(k, feedback.data());
      inverse_curvature_[k] = 0.0;
      cross_ += 0.5 * curvature * feedback;
      next_ += cross_ * feedback.transpose() + feedback * cross_.transpose();
    } else {
      inverse_curvature_[k] = 1.0 / curvature;
      feedback = -inverse_curvature_[k] * cross_;
      pivot_row_ = std::sqrt(inverse_curvature_[k]) * cross_;
      take_off_square(n, pivot_row_.data(), next_.data());
    }
    add_rows(k, next_);
    for (std::size_t r = 1; r < n; ++r) {
      for (std::size_t c = 0; c < r; ++c) {
        next_.data()[r * n + c] = next_.data()[c * n + r];
      }
    }
    cost_to_go_.swap(next_);
  }
  return factor_start();
}

bool StageForm::factor_start() {
  const Eigen::MatrixXd reduced = start_basis_.transpose() * cost_to_go_ * start_basis_;
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

}  // namespace unflex::compensate
