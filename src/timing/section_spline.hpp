// A motion along a section as splines: the flat outputs of both axes, and time.
//
// Notation as in section_nodes.hpp, uniform_spline.hpp, time_derivatives.hpp and flat_output.hpp.
// Time is counted in node periods, and places from the section's beginning.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "flat_output.hpp"
#include "section_motion.hpp"
#include "section_nodes.hpp"
#include "time_derivatives.hpp"
#include "uniform_spline.hpp"

namespace unflex::timing {

template <int D>
class SectionSpline {
 public:
  using Values = Derivatives<D>;
  using Shares = SplineShares<D>;
  static constexpr int kPerPoint = 3;  // x, y, t of a control point
  static constexpr int kWidth = kPerPoint * (D + 1);
  using Gradient = Eigen::Matrix<double, kWidth, 1>;
  // A control point stands for the node so many before it.
  static constexpr int kAhead = (D - 1) / 2;

  // The first plan of the nodes: even time, and its places smoothed by the spline.
  SectionSpline(const Section& section, const SectionRules& rules, const SectionNodes& nodes)
      : x_(flat_output<D>(rules.x, nodes.period_s())),
        y_(flat_output<D>(rules.y, nodes.period_s())),
        origin_(nodes.place(0)),
        period_s_(nodes.period_s()),
        periods_(nodes.periods()) {
    const auto last = static_cast<long>(periods_);
    for (long node = -kAhead; node < last + D - kAhead; ++node) {
      const Vector at = nodes.place(static_cast<std::size_t>(std::clamp(node, 0L, last)));
      points_.insert(points_.end(),
                     {at.x - origin_.x, at.y - origin_.y, static_cast<double>(node)});
    }
    set_end(0, section.legs.front(), 0.0, section.starts_even);
    set_end(periods_, section.legs.back(), section.legs.back().move.length_mm, section.ends_even);
    if (section.nozzle) {
      set_swing(0, x_, section.nozzle->x, origin_.x);
      set_swing(1, y_, section.nozzle->y, origin_.y);
    }
  }

  // What makes the derivatives by u at an end of the D control points there.
  static Eigen::Matrix<double, D, D> end_matrix() {
    const Shares shares = spline_shares<D>(0.0);
    Eigen::Matrix<double, D, D> matrix;
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) {
        matrix(i, j) = shares[i][j];
      }
    }
    return matrix;
  }

  [[nodiscard]] const FlatOutput<D>& x() const { return x_; }
  [[nodiscard]] const FlatOutput<D>& y() const { return y_; }
  [[nodiscard]] Vector origin() const { return origin_; }
  [[nodiscard]] double period_s() const { return period_s_; }
  [[nodiscard]] std::size_t periods() const { return periods_; }
  [[nodiscard]] std::vector<double>& points() { return points_; }
  [[nodiscard]] const std::vector<double>& points() const { return points_; }

  // A derivative of T at node k and the shares' x.
  [[nodiscard]] double clock(std::size_t k, const Shares& shares, int derivative = 0) const {
    double sum = 0.0;
    for (int i = 0; i <= D; ++i) {
      sum += shares[derivative][i] * points_[kPerPoint * (k + i) + 2];
    }
    return sum;
  }

  // All there is to know at one u.
  struct Place {
    TimeDerivatives<D> by_time;
    Values x;  // the flat outputs and their derivatives by time
    Values y;
  };
  [[nodiscard]] Place place(std::size_t k, const Shares& shares) const {
    // x, y and t side by side in a register; the fourth is not used.
    std::array<std::array<double, 4>, D + 1> points{};
    for (std::size_t i = 0; i <= D; ++i) {
      std::copy_n(&points_[kPerPoint * (k + i)], kPerPoint, points[i].data());
    }
    Values x{};
    Values y{};
    Values t{};
    for (int j = 0; j < D; ++j) {
      std::array<double, 4> sum{};
      for (std::size_t i = 0; i <= D; ++i) {
        for (std::size_t lane = 0; lane < sum.size(); ++lane) {
          sum[lane] += shares[j][i] * points[i][lane];
        }
      }
      x[j] = sum[0];
      y[j] = sum[1];
      t[j] = sum[2];
    }
    const TimeDerivatives<D> by_time(t);
    return {by_time, by_time.by_time(x), by_time.by_time(y)};
  }

  static double dot(const Values& a, const Values& b) {
    double sum = 0.0;
    for (int i = 0; i < D; ++i) {
      sum += a[i] * b[i];
    }
    return sum;
  }
  // What the factors make of the flat outputs.
  static Vector apply(const Values& of_x, const Values& of_y, const Place& at) {
    return {dot(of_x, at.x), dot(of_y, at.y)};
  }
  [[nodiscard]] Vector nozzle_mm(const Place& at) const {
    const Vector p = apply(x_.nozzle, y_.nozzle, at);
    return {origin_.x + p.x, origin_.y + p.y};
  }

  // scale (n_x times what of_x makes of x, and likewise of y), and its gradient in the control
  // points from number k on.
  double linearise(const Place& at, const Shares& shares, Vector n, const Values& of_x,
                   const Values& of_y, double scale, Gradient& g) const {
    const Values x = at.by_time.by_function(of_x);
    const Values y = at.by_time.by_function(of_y);
    const Values clock_x = at.by_time.by_clock(of_x, at.x);
    const Values clock_y = at.by_time.by_clock(of_y, at.y);
    std::array<std::array<double, 4>, D> factors{};  // of x, y and t
    for (int j = 0; j < D; ++j) {
      factors[j] = {x[j] * (scale * n.x), y[j] * (scale * n.y),
                    scale * (n.x * clock_x[j] + n.y * clock_y[j]), 0.0};
    }
    for (int i = 0; i <= D; ++i) {
      std::array<double, 4> sum{};
      for (int j = 0; j < D; ++j) {
        for (std::size_t lane = 0; lane < sum.size(); ++lane) {
          sum[lane] += factors[j][lane] * shares[j][i];
        }
      }
      for (int part = 0; part < kPerPoint; ++part) {
        g[kPerPoint * i + part] = sum[static_cast<std::size_t>(part)];
      }
    }
    const Vector value = apply(of_x, of_y, at);
    return scale * (n.x * value.x + n.y * value.y);
  }

 private:
  // An end at rest, or in even motion, which the flat output follows as far behind as the nozzle is
  // ahead of it.
  void set_end(std::size_t first, const Leg& leg, double along_mm, bool is_even) {
    const Vector d = direction_of(leg);
    const Vector start = start_of(leg);
    const double step_mm = is_even ? leg.feed_mm_s * period_s_ : 0.0;
    for (int j = 0; j < D; ++j) {
      double* const point = &points_[kPerPoint * (first + j)];
      const double ahead = static_cast<double>(j - kAhead);
      point[0] = start.x - origin_.x + d.x * (along_mm + step_mm * (ahead - x_.nozzle[1]));
      point[1] = start.y - origin_.y + d.y * (along_mm + step_mm * (ahead - y_.nozzle[1]));
    }
  }

  // One axis begins with a nozzle that swings on a base at rest. What a different frequency would
  // make of it counts from there on.
  void set_swing(int axis, const FlatOutput<D>& flat, const dynamics::NozzleMotion& nozzle,
                 double base_mm) {
    using Square = Eigen::Matrix<double, D, D>;
    using Column = Eigen::Matrix<double, D, 1>;
    const Values known[] = {flat.nozzle,
                            flat.nozzle_speed,
                            flat.base,
                            flat.base_speed,
                            flat.base_accel,
                            flat.sensitivity,
                            once_more<D>(flat.sensitivity)};
    Square state;
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) {
        state(i, j) = known[i][j];
      }
    }
    Column values = Column::Zero();
    values[0] = nozzle.position - base_mm;
    values[1] = nozzle.velocity * period_s_;
    const Column derivatives = state.fullPivLu().solve(values);
    const Column points = end_matrix().fullPivLu().solve(derivatives);
    for (int j = 0; j < D; ++j) {
      points_[kPerPoint * j + axis] = points[j];
    }
  }

  FlatOutput<D> x_;
  FlatOutput<D> y_;
  Vector origin_;
  double period_s_;
  std::size_t periods_;
  std::vector<double> points_;
};

}  // namespace unflex::timing
