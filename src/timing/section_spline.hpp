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
#include "unflex/core/axes.hpp"
#include "unflex/core/xy.hpp"
#include "uniform_spline.hpp"

namespace unflex::timing {

template <int D>
class SectionSpline {
 public:
  using Values = Derivatives<D>;
  using Shares = SplineShares<D>;
  // A control point has a place on each axis, and then t.
  static constexpr int kTime = XY::kCount;
  static constexpr int kPerPoint = kTime + 1;
  static constexpr int kWidth = kPerPoint * (D + 1);
  using Gradient = Eigen::Matrix<double, kWidth, 1>;
  // A control point stands for the node so many before it.
  static constexpr int kAhead = (D - 1) / 2;

  // The first plan of the nodes: even time, and its places smoothed by the spline.
  SectionSpline(const Section& section, const SectionRules& rules, const SectionNodes& nodes)
      : origin_(nodes.place(0)), period_s_(nodes.period_s()), periods_(nodes.periods()) {
    const auto flat = map_axes(
        [&](const dynamics::Mode& mode) { return flat_output<D>(mode, period_s_); }, rules);
    flat_ = of_all_axes(flat);
    const auto last = static_cast<long>(periods_);
    for (long node = -kAhead; node < last + D - kAhead; ++node) {
      const XY at = nodes.place(static_cast<std::size_t>(std::clamp(node, 0L, last))) - origin_;
      for_each_axis([&](double place) { points_.push_back(place); }, at);
      points_.push_back(static_cast<double>(node));
    }
    set_end(0, section.legs.front(), 0.0, section.starts_even);
    set_end(periods_, section.legs.back(), section.legs.back().move.length_mm, section.ends_even);
    if (section.nozzle) {
      for (std::size_t axis = 0; axis < XY::kCount; ++axis) {
        set_swing(axis, flat[axis], (*section.nozzle)[axis]);
      }
    }
  }

  // The matrix that turns the D control points at an end into the derivatives by u there.
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

  [[nodiscard]] const FlatOutputs<D>& flat() const { return flat_; }
  [[nodiscard]] XY origin() const { return origin_; }
  [[nodiscard]] double period_s() const { return period_s_; }
  [[nodiscard]] std::size_t periods() const { return periods_; }
  [[nodiscard]] std::vector<double>& points() { return points_; }
  [[nodiscard]] const std::vector<double>& points() const { return points_; }

  // A derivative of T at node k and the shares' x.
  [[nodiscard]] double clock(std::size_t k, const Shares& shares, int derivative = 0) const {
    double sum = 0.0;
    for (int i = 0; i <= D; ++i) {
      sum += shares[derivative][i] * points_[kPerPoint * (k + i) + kTime];
    }
    return sum;
  }

  // The motion at one u.
  struct Place {
    TimeDerivatives<D> by_time;
    Axes<Values> flat;  // the flat outputs and their derivatives by time
  };
  [[nodiscard]] Place place(std::size_t k, const Shares& shares) const {
    // x, y and t side by side in a register; the fourth is not used.
    std::array<std::array<double, 4>, D + 1> points{};
    for (std::size_t i = 0; i <= D; ++i) {
      std::copy_n(&points_[kPerPoint * (k + i)], kPerPoint, points[i].data());
    }
    Axes<Values> flat{};
    Values t{};
    for (int j = 0; j < D; ++j) {
      std::array<double, 4> sum{};
      for (std::size_t i = 0; i <= D; ++i) {
        for (std::size_t lane = 0; lane < sum.size(); ++lane) {
          sum[lane] += shares[j][i] * points[i][lane];
        }
      }
      for (std::size_t axis = 0; axis < XY::kCount; ++axis) {
        flat[axis][j] = sum[axis];
      }
      t[j] = sum[kTime];
    }
    const TimeDerivatives<D> by_time(t);
    return {by_time,
            map_axes([&](const Values& by_node) { return by_time.by_time(by_node); }, flat)};
  }

  static double sum_of_products(const Values& a, const Values& b) {
    double sum = 0.0;
    for (int i = 0; i < D; ++i) {
      sum += a[i] * b[i];
    }
    return sum;
  }
  // The sum over the flat outputs' derivatives, times these factors, for each axis.
  static XY apply(const Axes<Values>& factors, const Place& at) {
    return map_axes(sum_of_products, factors, at.flat);
  }
  [[nodiscard]] XY nozzle_mm(const Place& at) const { return origin_ + apply(flat_.nozzle, at); }

  // scale n·apply(of, at), and its gradient in the control points from number k on.
  double linearise(const Place& at, const Shares& shares, const XY& n, const Axes<Values>& of,
                   double scale, Gradient& g) const {
    const Axes<Values> by_function =
        map_axes([&](const Values& of_axis) { return at.by_time.by_function(of_axis); }, of);
    const Axes<Values> by_clock =
        map_axes([&](const Values& of_axis,
                     const Values& flat) { return at.by_time.by_clock(of_axis, flat); },
                 of, at.flat);
    std::array<std::array<double, 4>, D> factors{};  // of the places and of t
    for (int j = 0; j < D; ++j) {
      for (std::size_t axis = 0; axis < XY::kCount; ++axis) {
        factors[j][axis] = by_function[axis][j] * (scale * n[axis]);
      }
      factors[j][kTime] =
          scale * sum_of_axes([&](double share, const Values& clock) { return share * clock[j]; },
                              n, by_clock);
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
    return scale * dot(n, apply(of, at));
  }

 private:
  // Sets an end at rest or in even motion. In even motion the flat output follows the nozzle at a
  // constant distance.
  void set_end(std::size_t first, const Leg& leg, double along_mm, bool is_even) {
    const XY d = direction_of(leg);
    const XY start = start_of(leg);
    const double step_mm = is_even ? leg.feed_mm_s * period_s_ : 0.0;
    for (int j = 0; j < D; ++j) {
      double* const point = &points_[kPerPoint * (first + j)];
      const double ahead = static_cast<double>(j - kAhead);
      for (std::size_t axis = 0; axis < XY::kCount; ++axis) {
        point[axis] = start[axis] - origin_[axis] +
                      d[axis] * (along_mm + step_mm * (ahead - flat_.nozzle[axis][1]));
      }
    }
  }

  // Sets the beginning of an axis whose nozzle swings on a base at rest. The effect of a different
  // frequency counts from there on.
  void set_swing(std::size_t axis, const FlatOutput<D>& flat,
                 const dynamics::NozzleMotion& nozzle) {
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
    values[0] = nozzle.position - origin_[axis];
    values[1] = nozzle.velocity * period_s_;
    const Column derivatives = state.fullPivLu().solve(values);
    const Column points = end_matrix().fullPivLu().solve(derivatives);
    for (int j = 0; j < D; ++j) {
      points_[kPerPoint * j + axis] = points[j];
    }
  }

  FlatOutputs<D> flat_;
  XY origin_;
  double period_s_;
  std::size_t periods_;
  std::vector<double> points_;
};

}  // namespace unflex::timing
