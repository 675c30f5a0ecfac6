#include "line_cost.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

namespace unflex::emit {
namespace {

using dynamics::BaseTrajectory;
using dynamics::FlexibleAxis;

// Candidate times per node of the base.
constexpr std::size_t kPerNode = 2;
// During a line the error is sampled at no more than this many moments.
constexpr std::size_t kLooks = 16;

// Where (e, ė, o, u) of an axis stand in w.
constexpr std::array<std::array<int, 4>, 2> kPlace = {{{0, 1, 2, 6}, {3, 4, 5, 7}}};

NozzleAnswers nozzle_answers(const FlexibleAxis& axis, double dt, std::size_t count) {
  const StepMatrix step(axis, dt);
  NozzleAnswers result;
  result.free.emplace_back(Eigen::Matrix2d::Identity());
  result.step.emplace_back(Eigen::Vector2d::Zero());
  result.ramp.emplace_back(Eigen::Vector2d::Zero());
  for (std::size_t j = 0; j < count; ++j) {
    result.free.emplace_back(step.free() * result.free.back());
    result.step.emplace_back(step.free() * result.step.back() + step.base(1.0, 0.0));
    result.ramp.emplace_back(step.free() * result.ramp.back() +
                             step.base(static_cast<double>(j) * dt, 1.0));
  }
  return result;
}

}  // namespace

WholeCost whole_cost(const LineCost& line, const Quadratic& to_go) {
  // lazyProduct: Eigen's blocked product does not pay at this size.
  const Eigen::Matrix<double, 6, 8> moved = to_go.matrix.lazyProduct(line.move);
  const Vector6d pull = to_go.matrix.lazyProduct(line.shift) + to_go.slope;
  return {line.matrix + line.move.transpose().lazyProduct(moved),
          line.slope + line.move.transpose().lazyProduct(pull),
          line.constant + to_go.at(line.shift)};
}

LineChoice best_end(const LineCost& line, const Quadratic& to_go) {
  const auto [all, slope, constant] = whole_cost(line, to_go);
  LineChoice choice;
  choice.stiffness = all.bottomRightCorner<2, 2>();
  const Eigen::Matrix2d inverse = choice.stiffness.inverse();
  choice.feedback = -inverse * all.bottomLeftCorner<2, 6>();
  choice.feed_forward = -inverse * slope.tail<2>();
  choice.value.matrix = all.topLeftCorner<6, 6>() + all.topRightCorner<6, 2>() * choice.feedback;
  choice.value.slope = slope.head<6>() + all.topRightCorner<6, 2>() * choice.feed_forward;
  choice.value.constant =
      line.constant + to_go.at(line.shift) + 0.5 * slope.tail<2>().dot(choice.feed_forward);
  return choice;
}

Quadratic ending_on_base(const LineCost& line, const Quadratic& to_go) {
  const auto [all, slope, constant] = whole_cost(line, to_go);
  return {all.topLeftCorner<6, 6>(), slope.head<6>(), constant};
}

LineCosts::LineCosts(const BaseTrajectory& base, const std::function<ErrorWeight(double)>& weight,
                     const LineRules& rules)
    : nozzle_x_(rules.nozzle_x), nozzle_y_(rules.nozzle_y), dt_s_(base.period_s / kPerNode) {
  const Followed follows_x(base, &BaseTrajectory::x_at, nozzle_x_);
  const Followed follows_y(base, &BaseTrajectory::y_at, nozzle_y_);
  const std::size_t count = (base.nodes() - 1) * kPerNode + 1;
  base_.reserve(count);
  nozzle_x_at_.reserve(count);
  nozzle_y_at_.reserve(count);
  weights_.reserve(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double t = time_s(k);
    base_.emplace_back(base.x_at(t).position_mm, base.y_at(t).position_mm);
    nozzle_x_at_.push_back(follows_x.at(t));
    nozzle_y_at_.push_back(follows_y.at(t));
    weights_.push_back(weight(t));
  }
  const auto longest = static_cast<std::size_t>(std::ceil(rules.max_line_s / dt_s_)) + 1;
  x_ = nozzle_answers(nozzle_x_, dt_s_, longest);
  y_ = nozzle_answers(nozzle_y_, dt_s_, longest);
  shapes_.emplace_back();
  for (std::size_t m = 1; m <= longest; ++m) {
    shapes_.push_back(shape(m));
  }
  same_weight_until_.assign(count, count - 1);
  for (std::size_t k = count - 1; k-- > 0;) {
    same_weight_until_[k] = weights_[k] == weights_[k + 1] ? same_weight_until_[k + 1] : k;
  }
}

std::size_t LineCosts::candidates(double duration_s) const {
  return static_cast<std::size_t>(std::ceil(duration_s / dt_s_ - 1e-9));
}

LineCosts::Shape LineCosts::shape(std::size_t m) const {
  const double duration = static_cast<double>(m) * dt_s_;
  Shape result;
  const std::size_t looks = std::min(m, kLooks);
  const double between_s = duration / static_cast<double>(looks);
  for (std::size_t look = 1; look <= looks; ++look) {
    const std::size_t j = look * m / looks;
    const auto row = [&](const NozzleAnswers& answer) {
      const double ramp = answer.ramp[j][0] / duration;
      return Row(answer.free[j](0, 0), answer.free[j](0, 1), answer.step[j][0] - ramp, ramp);
    };
    const double s = static_cast<double>(j) / static_cast<double>(m);
    result.looks.push_back({j, s, row(x_), row(y_)});
    const Row& x = result.looks.back().x;
    const Row& y = result.looks.back().y;
    result.xx += between_s * x.transpose() * x;
    result.xy += between_s * x.transpose() * y;
    result.yy += between_s * y.transpose() * y;
    const Row base(0.0, 0.0, 1.0 - s, s);
    result.base += kBaseWeight * between_s * base.transpose() * base;
  }
  return result;
}

LineCost LineCosts::line(std::size_t k, std::size_t m) const {
  const double duration = static_cast<double>(m) * dt_s_;
  const Shape& shape = shapes_[m];
  LineCost result;
  const std::array<const NozzleAnswers*, 2> answers = {&x_, &y_};
  const std::array<const std::vector<Eigen::Vector2d>*, 2> nozzle = {&nozzle_x_at_, &nozzle_y_at_};
  // The motion that the chord from b_k to b_{k+m} alone would make.
  std::array<Eigen::Vector2d, 2> begin;
  std::array<double, 2> speed{};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    begin[axis] = (*nozzle[axis])[k] - Eigen::Vector2d(base_[k][a], 0.0);
    speed[axis] = (base_[k + m][a] - base_[k][a]) / duration;
  }
  const bool same_weight = same_weight_until_[k + 1] >= k + m;
  const ErrorWeight& only = weights_[k + 1];
  Eigen::Matrix4d xx = shape.base;
  Eigen::Matrix4d xy = Eigen::Matrix4d::Zero();
  Eigen::Matrix4d yy = shape.base;
  if (same_weight) {
    xx += only.xx * shape.xx;
    xy = only.xy * shape.xy;
    yy += only.yy * shape.yy;
  }
  Row slope_x = Row::Zero();
  Row slope_y = Row::Zero();
  const double between_s = duration / static_cast<double>(shape.looks.size());
  const double base_weight = kBaseWeight * between_s;
  for (const Shape::Look& look : shape.looks) {
    const std::size_t j = look.j;
    std::array<double, 2> off{};
    std::array<double, 2> off_base{};
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const auto a = static_cast<Eigen::Index>(axis);
      const NozzleAnswers& answer = *answers[axis];
      off[axis] = answer.free[j](0, 0) * begin[axis][0] + answer.free[j](0, 1) * begin[axis][1] +
                  answer.ramp[j][0] * speed[axis] - ((*nozzle[axis])[k + j][0] - base_[k][a]);
      off_base[axis] = speed[axis] * look.s * duration - (base_[k + j][a] - base_[k][a]);
    }
    const ErrorWeight& w = weights_[k + j];
    if (!same_weight) {
      xx += between_s * w.xx * look.x.transpose() * look.x;
      xy += between_s * w.xy * look.x.transpose() * look.y;
      yy += between_s * w.yy * look.y.transpose() * look.y;
    }
    const double to_x = between_s * (w.xx * off[0] + w.xy * off[1]);
    const double to_y = between_s * (w.xy * off[0] + w.yy * off[1]);
    slope_x += to_x * look.x;
    slope_y += to_y * look.y;
    const Row base(0.0, 0.0, 1.0 - look.s, look.s);
    slope_x += base_weight * off_base[0] * base;
    slope_y += base_weight * off_base[1] * base;
    result.constant += 0.5 * (to_x * off[0] + to_y * off[1]) +
                       0.5 * base_weight * (off_base[0] * off_base[0] + off_base[1] * off_base[1]);
  }
  for (int i = 0; i < 4; ++i) {
    const int xi = kPlace[0][static_cast<std::size_t>(i)];
    const int yi = kPlace[1][static_cast<std::size_t>(i)];
    for (int j = 0; j < 4; ++j) {
      const int xj = kPlace[0][static_cast<std::size_t>(j)];
      const int yj = kPlace[1][static_cast<std::size_t>(j)];
      result.matrix(xi, xj) = xx(i, j);
      result.matrix(xi, yj) = xy(i, j);
      result.matrix(yj, xi) = xy(i, j);
      result.matrix(yi, yj) = yy(i, j);
    }
    result.slope[xi] = slope_x[i];
    result.slope[yi] = slope_y[i];
  }
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto a = static_cast<Eigen::Index>(axis);
    const NozzleAnswers& answer = *answers[axis];
    const Eigen::Index first = 3 * a;
    result.move.block<2, 2>(first, first) = answer.free[m];
    result.move.block<2, 1>(first, first + 2) = answer.step[m] - answer.ramp[m] / duration;
    result.move.block<2, 1>(first, 6 + a) = answer.ramp[m] / duration;
    result.move(first + 2, 6 + a) = 1.0;
    result.shift.segment<2>(first) = answer.free[m] * begin[axis] + answer.ramp[m] * speed[axis] -
                                     ((*nozzle[axis])[k + m] - Eigen::Vector2d(base_[k][a], 0.0));
  }
  return result;
}

// The first step is late, and the others have caught up at the line's end. So the place lags by a
// triangle, δ high, over the line's time T. To the nozzle this is nearly an impulse of ω² δ T / 2
// at the triangle's centroid.
Vector6d LineCosts::lead_kick(double line_s, double steps, const Eigen::Vector2d& speed_mm_s,
                              double before_mm_s) const {
  Vector6d kick = Vector6d::Zero();
  const double v = speed_mm_s.norm();
  if (v <= before_mm_s) {
    return kick;
  }
  const double step_s = line_s / steps;
  const double first_s = before_mm_s > 0.0 ? std::min(step_s * v / before_mm_s, line_s) : line_s;
  const Eigen::Vector2d area = 0.5 * (first_s - step_s) * line_s * speed_mm_s;
  const double after_s = line_s - (first_s + line_s) / 3.0;
  const auto j = static_cast<std::size_t>(after_s / dt_s_ + 0.5);
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const double omega = (axis == 0 ? nozzle_x_ : nozzle_y_).omega_rad_s;
    const auto a = static_cast<Eigen::Index>(axis);
    kick.segment<2>(3 * a) = -omega * omega * area[a] * answers(axis).free[j].col(1);
  }
  return kick;
}

Quadratic LineCosts::ring_down() const {
  Quadratic result;
  result.matrix.block<2, 2>(0, 0) = weights_.back().xx * ring_down_square(nozzle_x_);
  result.matrix.block<2, 2>(3, 3) = weights_.back().yy * ring_down_square(nozzle_y_);
  return result;
}

}  // namespace unflex::emit
