// The control points at both ends of a section: which of them are fixed, and how those that stand
// for others move them.
//
// Where the base rests at an end, b̈ may jump there, and nothing below it. So the D control points
// of that end have one freedom per axis. One of the points has that freedom, and the others follow
// it by fixed shares.
#pragma once

#include <Eigen/LU>
#include <cstddef>
#include <span>
#include <vector>

#include "section_spline.hpp"
#include "sections.hpp"

namespace unflex::timing {

template <int D>
class SectionEnds {
 public:
  using Spline = SectionSpline<D>;
  using Gradient = typename Spline::Gradient;

  SectionEnds(const Section& section, std::size_t periods) : section_(section), periods_(periods) {
    const Eigen::Matrix<double, D, 1> shares =
        Spline::end_matrix().fullPivLu().solve(Eigen::Matrix<double, D, 1>::Unit(D - 1));
    for (int j = 0; j < D; ++j) {
      jump_[j] = shares[j];
    }
  }

  // Calls fix(point, coordinate) for the coordinates that do not change. In a plain program no time
  // changes.
  template <class Fix>
  void fix(bool is_plain, const Fix& fix) const {
    for (int j = 0; j < D; ++j) {
      for (const int axis : {0, 1}) {
        if (j + 1 < D || !jumps_at_start()) {
          fix(j, axis);
        }
        if (j > 0 || !jumps_at_end()) {
          fix(periods_ + j, axis);
        }
      }
    }
    const std::size_t fixed_times =
        is_plain ? periods_ + D : (section_.starts_even || section_.nozzle ? D : 1);
    for (std::size_t j = 0; j < fixed_times; ++j) {
      fix(j, Spline::kTime);
    }
  }

  // A gradient in the control points from number k on, written for the points that may move: those
  // that follow add their entries to the point that they follow.
  [[nodiscard]] Gradient folded(std::size_t k, const Gradient& g) const {
    Gradient result = g;
    const auto fold = [&](std::size_t point, std::size_t onto, double share) {
      for (const int axis : {0, 1}) {
        double& own = result[static_cast<long>(Spline::kPerPoint * (point - k)) + axis];
        result[static_cast<long>(Spline::kPerPoint * (onto - k)) + axis] += share * own;
        own = 0.0;
      }
    };
    for (std::size_t j = k; jumps_at_start() && j + 1 < D; ++j) {
      fold(j, D - 1, jump_[j] / jump_[D - 1]);
    }
    for (std::size_t j = 1; jumps_at_end() && periods_ + j <= k + D; ++j) {
      fold(periods_ + j, periods_, jump_[j] / jump_[0]);
    }
    return result;
  }

  // Takes the step of the control points.
  void take(std::span<const double> step, std::vector<double>& points) const {
    for (std::size_t i = 0; i < points.size(); ++i) {
      points[i] += step[i];
    }
    const std::size_t end = Spline::kPerPoint * periods_;
    for (const int axis : {0, 1}) {
      for (int j = 0; jumps_at_start() && j + 1 < D; ++j) {
        points[Spline::kPerPoint * j + axis] +=
            jump_[j] / jump_[D - 1] * step[Spline::kPerPoint * (D - 1) + axis];
      }
      for (int j = 1; jumps_at_end() && j < D; ++j) {
        points[end + Spline::kPerPoint * j + axis] += jump_[j] / jump_[0] * step[end + axis];
      }
    }
  }

 private:
  [[nodiscard]] bool jumps_at_start() const { return !section_.starts_even && !section_.nozzle; }
  [[nodiscard]] bool jumps_at_end() const { return !section_.ends_even; }

  const Section& section_;
  std::size_t periods_;
  typename Spline::Values jump_{};  // shares of the points in a jump of b̈
};

}  // namespace unflex::timing
