#include "line_fan.hpp"

#include <tuple>

namespace unflex::emit {

template <int kModes>
void LineFan<kModes>::begin(std::size_t k, std::span<const ZVector<kModes>> states) {
  k_ = k;
  m_ = 0;
  x_ = {.answers = &costs_->answers(0)};
  y_ = {.answers = &costs_->answers(1)};
  square_.setZero();
  ramps_xy_ = base_square_ = times_s_ = times_squared_ = 0.0;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const ModesVector<kModes>& nozzle = costs_->nozzle(axis, k);
    const ModesVector<kModes> base = costs_->riding(axis, costs_->base_mm(k)[a]);
    Axis& all = axis == 0 ? x_ : y_;
    for (std::size_t i = 0; i < states.size(); ++i) {
      const auto lane = static_cast<Eigen::Index>(i);
      const auto& z = states[i].template segment<kOfAxis<kModes>>(kOfAxis<kModes> * a);
      const double place = z[2 * kModes];
      const ModesVector<kModes> begun = costs_->riding(axis, place);
      all.place[lane] = place;
      for (Eigen::Index part = 0; part < 2 * kModes; ++part) {
        all.behind[static_cast<std::size_t>(part)][lane] =
            z[part] + nozzle[part] - base[part] - begun[part];
      }
    }
  }
}

template <int kModes>
void LineFan<kModes>::reach(std::size_t m) {
  const Eigen::Vector2d& base = costs_->base_mm(k_);
  const double share = 1.0 / static_cast<double>(costs_->nozzles());
  for (std::size_t j = m_ + 1; j <= m; ++j) {
    const ErrorWeight& w = costs_->weight(k_ + j);
    for (std::size_t nozzle = 0; nozzle < costs_->nozzles(); ++nozzle) {
      const auto error = [&](const Axis& axis, std::size_t index) -> Lanes {
        const auto& free = axis.answers->free[j];
        const double off = base[static_cast<Eigen::Index>(index)] -
                           costs_->place(nozzle, costs_->nozzle(index, k_ + j));
        Lanes sum = axis.place + off;
        for (auto [i, end] = costs_->entries(nozzle); i < end; ++i) {
          sum += free(0, i) * axis.behind[i];
        }
        return sum;
      };
      const Lanes ex = error(x_, 0);
      const Lanes ey = error(y_, 1);
      const Lanes to_x = share * (w.xx * ex + w.xy * ey);
      const Lanes to_y = share * (w.xy * ex + w.yy * ey);
      const double ramp_x = costs_->place(nozzle, x_.answers->ramp[j]);
      const double ramp_y = costs_->place(nozzle, y_.answers->ramp[j]);
      square_ += to_x * ex + to_y * ey;
      x_.pull += ramp_x * to_x;
      y_.pull += ramp_y * to_y;
      x_.ramps += share * w.xx * ramp_x * ramp_x;
      ramps_xy_ += share * w.xy * ramp_x * ramp_y;
      y_.ramps += share * w.yy * ramp_y * ramp_y;
    }
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

template <int kModes>
void LineFan<kModes>::finish(Axis& axis, Eigen::Index index) const {
  const double dt = costs_->dt_s();
  axis.slope = dt * (axis.pull + kBaseWeight * (times_s_ * axis.place - axis.time_base));
  axis.stiffness = dt * (axis.ramps + kBaseWeight * times_squared_);
  const auto& free = axis.answers->free[m_];
  const auto which = static_cast<std::size_t>(index);
  const ModesVector<kModes>& nozzle = costs_->nozzle(which, k_ + m_);
  const double from = costs_->base_mm(k_)[index];
  const ModesVector<kModes> base = costs_->riding(which, from);
  for (std::size_t mode = 0; mode < kModes; ++mode) {
    const auto at = static_cast<Eigen::Index>(2 * mode);
    const double gain = costs_->gain(which, mode);
    const Lanes& behind = axis.behind[2 * mode];
    const Lanes& speed = axis.behind[2 * mode + 1];
    axis.error[2 * mode] = gain * axis.place + (base[at] - nozzle[at]) + free(0, at) * behind +
                           free(0, at + 1) * speed;
    axis.error[2 * mode + 1] = free(1, at) * behind + free(1, at + 1) * speed - nozzle[at + 1];
  }
  axis.end = axis.place + (from - costs_->base_mm(k_ + m_)[index]);
  axis.ramp = axis.answers->ramp[m_];
}

template <int kModes>
FanChoice LineFan<kModes>::choice(const Quadratic<kModes>& to_go) const {
  constexpr int kZ = kOfZ<kModes>;
  constexpr int kAxis = kOfAxis<kModes>;
  const ZMatrix<kModes>& p = to_go.matrix;
  const auto along = [&](const Axis& axis, Eigen::Index first) {
    ZVector<kModes> sum = p.col(first) * axis.ramp[0];
    for (Eigen::Index i = 1; i < 2 * kModes; ++i) {
      sum += p.col(first + i) * axis.ramp[i];
    }
    return ZVector<kModes>(sum + p.col(first + 2 * kModes) * duration_s_);
  };
  const ZVector<kModes> along_x = along(x_, 0);
  const ZVector<kModes> along_y = along(y_, kAxis);
  const auto gain = [&](const Axis& axis, Eigen::Index first, const ZVector<kModes>& v) {
    double sum = axis.ramp[0] * v[first];
    for (Eigen::Index i = 1; i < 2 * kModes; ++i) {
      sum += axis.ramp[i] * v[first + i];
    }
    return sum + duration_s_ * v[first + 2 * kModes];
  };
  FanChoice result;
  result.xx = x_.stiffness + gain(x_, 0, along_x);
  result.xy = stiffness_xy_ + gain(y_, kAxis, along_x);
  result.yy = y_.stiffness + gain(y_, kAxis, along_y);

  std::array<const Lanes*, kZ> z{};
  for (std::size_t i = 0; i < 2 * kModes; ++i) {
    z[i] = &x_.error[i];
    z[kAxis + i] = &y_.error[i];
  }
  z[2 * kModes] = &x_.end;
  z[kAxis + 2 * kModes] = &y_.end;
  Lanes slope_x = x_.slope + gain(x_, 0, to_go.slope);
  Lanes slope_y = y_.slope + gain(y_, kAxis, to_go.slope);
  Lanes still = held_ + to_go.constant;  // for v = 0
  for (std::size_t i = 0; i < kZ; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    slope_x += along_x[row] * *z[i];
    slope_y += along_y[row] * *z[i];
    Lanes pull = to_go.slope[row] + 0.5 * p(row, row) * *z[i];
    for (std::size_t j = i + 1; j < kZ; ++j) {
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

template <int kModes>
double LineFan<kModes>::cost(std::size_t lane, const Eigen::Vector2d& v) const {
  const auto i = static_cast<Eigen::Index>(lane);
  return held_[i] + v[0] * (x_.slope[i] + 0.5 * x_.stiffness * v[0] + stiffness_xy_ * v[1]) +
         v[1] * (y_.slope[i] + 0.5 * y_.stiffness * v[1]);
}

template <int kModes>
ZVector<kModes> LineFan<kModes>::after(std::size_t lane, const Eigen::Vector2d& v) const {
  const auto i = static_cast<Eigen::Index>(lane);
  ZVector<kModes> z;
  for (const auto& [axis, first, speed] : {std::tuple{&x_, Eigen::Index{0}, v[0]},
                                           std::tuple{&y_, Eigen::Index{kOfAxis<kModes>}, v[1]}}) {
    for (Eigen::Index part = 0; part < 2 * kModes; ++part) {
      z[first + part] = axis->error[static_cast<std::size_t>(part)][i] + axis->ramp[part] * speed;
    }
    z[first + 2 * kModes] = axis->end[i] + duration_s_ * speed;
  }
  return z;
}

template class LineFan<1>;
template class LineFan<2>;
template class LineFan<3>;
template class LineFan<4>;
template class LineFan<6>;

}  // namespace unflex::emit
