#include "line_fan.hpp"

namespace unflex::emit {

void LineFan::begin(std::size_t k, std::span<const Vector6d> states) {
  k_ = k;
  m_ = 0;
  x_ = {.answers = &costs_->answers(0)};
  y_ = {.answers = &costs_->answers(1)};
  square_.setZero();
  ramps_xy_ = base_square_ = times_s_ = times_squared_ = 0.0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const Eigen::Vector2d& nozzle = costs_->nozzle(axis, k);
    Axis& all = axis == 0 ? x_ : y_;
    for (std::size_t i = 0; i < states.size(); ++i) {
      const auto lane = static_cast<Eigen::Index>(i);
      const auto& z = states[i].segment<3>(3 * a);
      all.place[lane] = z[2];
      all.behind[lane] = z[0] + nozzle[0] - costs_->base_mm(k)[a] - z[2];
      all.speed[lane] = z[1] + nozzle[1];
    }
  }
}

void LineFan::reach(std::size_t m) {
  const Eigen::Vector2d& base = costs_->base_mm(k_);
  for (std::size_t j = m_ + 1; j <= m; ++j) {
    const ErrorWeight& w = costs_->weight(k_ + j);
    const auto error = [&](const Axis& axis, std::size_t index) -> Lanes {
      const Eigen::Matrix2d& free = axis.answers->free[j];
      const double off = base[static_cast<Eigen::Index>(index)] - costs_->nozzle(index, k_ + j)[0];
      return axis.place + off + free(0, 0) * axis.behind + free(0, 1) * axis.speed;
    };
    const Lanes ex = error(x_, 0);
    const Lanes ey = error(y_, 1);
    const Lanes to_x = w.xx * ex + w.xy * ey;
    const Lanes to_y = w.xy * ex + w.yy * ey;
    const double ramp_x = x_.answers->ramp[j][0];
    const double ramp_y = y_.answers->ramp[j][0];
    square_ += to_x * ex + to_y * ey;
    x_.pull += ramp_x * to_x;
    y_.pull += ramp_y * to_y;
    x_.ramps += w.xx * ramp_x * ramp_x;
    ramps_xy_ += w.xy * ramp_x * ramp_y;
    y_.ramps += w.yy * ramp_y * ramp_y;
    const double t = static_cast<double>(j) * costs_->dt_s();
    const Eigen::Vector2d way = costs_->base_mm(k_ + j) - base;
    x_.base += way[0];
    y_.base += way[1];
    x_.time_base += t * way[0];
    y_.time_base += t * way[1];
    base_square_ += way.squaredNorm();
    times_s_ += t;
    times_squared_ += t * t;
  }
  m_ = m;
  duration_s_ = static_cast<double>(m) * costs_->dt_s();
  finish(x_, 0);
  finish(y_, 1);
  const Lanes base_part = static_cast<double>(m) * (x_.place.square() + y_.place.square()) -
                          2.0 * (x_.base * x_.place + y_.base * y_.place) + base_square_;
  held_ = 0.5 * costs_->dt_s() * (square_ + kBaseWeight * base_part);
  stiffness_xy_ = costs_->dt_s() * ramps_xy_;
}

void LineFan::finish(Axis& axis, Eigen::Index index) const {
  const double dt = costs_->dt_s();
  axis.slope = dt * (axis.pull + kBaseWeight * (times_s_ * axis.place - axis.time_base));
  axis.stiffness = dt * (axis.ramps + kBaseWeight * times_squared_);
  const Eigen::Matrix2d& free = axis.answers->free[m_];
  const Eigen::Vector2d& nozzle = costs_->nozzle(static_cast<std::size_t>(index), k_ + m_);
  const double from = costs_->base_mm(k_)[index];
  axis.error = axis.place + (from - nozzle[0]) + free(0, 0) * axis.behind + free(0, 1) * axis.speed;
  axis.error_speed = free(1, 0) * axis.behind + free(1, 1) * axis.speed - nozzle[1];
  axis.end = axis.place + (from - costs_->base_mm(k_ + m_)[index]);
  axis.ramp = axis.answers->ramp[m_][0];
  axis.ramp_speed = axis.answers->ramp[m_][1];
}

LineFan::Choice LineFan::choice(const Quadratic& to_go) const {
  const Matrix6d& p = to_go.matrix;
  const Vector6d along_x = p.col(0) * x_.ramp + p.col(1) * x_.ramp_speed + p.col(2) * duration_s_;
  const Vector6d along_y = p.col(3) * y_.ramp + p.col(4) * y_.ramp_speed + p.col(5) * duration_s_;
  const auto gain_x = [&](const Vector6d& v) {
    return x_.ramp * v[0] + x_.ramp_speed * v[1] + duration_s_ * v[2];
  };
  const auto gain_y = [&](const Vector6d& v) {
    return y_.ramp * v[3] + y_.ramp_speed * v[4] + duration_s_ * v[5];
  };
  Choice result;
  result.xx = x_.stiffness + gain_x(along_x);
  result.xy = stiffness_xy_ + gain_y(along_x);
  result.yy = y_.stiffness + gain_y(along_y);

  const std::array<const Lanes*, 6> z = {&x_.error, &x_.error_speed, &x_.end,
                                         &y_.error, &y_.error_speed, &y_.end};
  Lanes slope_x = x_.slope + gain_x(to_go.slope);
  Lanes slope_y = y_.slope + gain_y(to_go.slope);
  Lanes still = held_ + to_go.constant;  // for v = 0
  for (std::size_t i = 0; i < 6; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    slope_x += along_x[row] * *z[i];
    slope_y += along_y[row] * *z[i];
    Lanes pull = to_go.slope[row] + 0.5 * p(row, row) * *z[i];
    for (std::size_t j = i + 1; j < 6; ++j) {
      pull += p(static_cast<Eigen::Index>(j), row) * *z[j];
    }
    still += pull * *z[i];
  }
  const double scale = -1.0 / (result.xx * result.yy - result.xy * result.xy);
  result.best_x_mm_s = scale * (result.yy * slope_x - result.xy * slope_y);
  result.best_y_mm_s = scale * (result.xx * slope_y - result.xy * slope_x);
  result.least = still + 0.5 * (slope_x * result.best_x_mm_s + slope_y * result.best_y_mm_s);
  return result;
}

double LineFan::cost(std::size_t lane, const Eigen::Vector2d& v) const {
  const auto i = static_cast<Eigen::Index>(lane);
  return held_[i] + v[0] * (x_.slope[i] + 0.5 * x_.stiffness * v[0] + stiffness_xy_ * v[1]) +
         v[1] * (y_.slope[i] + 0.5 * y_.stiffness * v[1]);
}

Vector6d LineFan::after(std::size_t lane, const Eigen::Vector2d& v) const {
  const auto i = static_cast<Eigen::Index>(lane);
  Vector6d z;
  z << x_.error[i] + x_.ramp * v[0], x_.error_speed[i] + x_.ramp_speed * v[0],
      x_.end[i] + duration_s_ * v[0], y_.error[i] + y_.ramp * v[1],
      y_.error_speed[i] + y_.ramp_speed * v[1], y_.end[i] + duration_s_ * v[1];
  return z;
}

}  // namespace unflex::emit
