#include "unflex/dynamics/mode_frame.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "unflex/core/math.hpp"

namespace unflex::dynamics {
namespace {

using Square = Eigen::MatrixXd;

// Squares of frequencies that differ by no more than this share are the same.
constexpr double kSame = 1e-9;

Square picked(const ModeFrame::Matrix& matrix, const std::vector<std::size_t>& axes, double times) {
  const auto n = static_cast<Eigen::Index>(axes.size());
  Square result(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      result(i, j) =
          times * matrix[axes[static_cast<std::size_t>(i)]][axes[static_cast<std::size_t>(j)]];
    }
  }
  return result;
}

// Modes of one frequency may be any basis of their space. This one follows the axes, as far as they
// lie in the space. vectors: ΦᵀMΦ = I.
void follow_axes(const Eigen::VectorXd& squares, const Square& mass, Square& vectors) {
  const Eigen::Index n = squares.size();
  for (Eigen::Index first = 0; first < n;) {
    Eigen::Index end = first + 1;
    while (end < n && squares(end) - squares(first) <= kSame * squares(end)) {
      ++end;
    }
    const Square space = vectors.middleCols(first, end - first);
    // Rotates the basis: each column is the part in the space of the axis that has the most of it,
    // without what the columns before have.
    Square basis(n, 0);
    while (basis.cols() < space.cols()) {
      Eigen::VectorXd best;
      double most = -1.0;
      for (Eigen::Index axis = 0; axis < n; ++axis) {
        Eigen::VectorXd part = space * (space.transpose() * mass.col(axis));
        part -= basis * (basis.transpose() * (mass * part));
        const double length = part.norm();
        if (length > (1.0 + kSame) * most) {
          most = length;
          best = part;
        }
      }
      basis.conservativeResize(n, basis.cols() + 1);
      basis.col(basis.cols() - 1) = best / std::sqrt(best.dot(mass * best));
    }
    vectors.middleCols(first, end - first) = basis;
    first = end;
  }
}

// The order of the modes in which each is as much along the axis of its number as can be.
std::vector<Eigen::Index> order_of(const Square& vectors) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(vectors.cols()));
  std::iota(order.begin(), order.end(), 0);
  std::vector<Eigen::Index> best = order;
  double most = -1.0;
  do {
    double along = 0.0;
    for (std::size_t i = 0; i < order.size(); ++i) {
      along += std::abs(vectors(static_cast<Eigen::Index>(i), order[i]));
    }
    if (along > (1.0 + kSame) * most) {
      most = along;
      best = order;
    }
  } while (std::ranges::next_permutation(order).found);
  return best;
}

double largest_off_diagonal(const Square& damping) {
  double largest = 0.0;
  for (Eigen::Index i = 0; i < damping.rows(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const double both = std::sqrt(damping(i, i) * damping(j, j));
      largest = both > 0.0 ? std::max(largest, std::abs(damping(i, j)) / both) : largest;
    }
  }
  return largest;
}

}  // namespace

Result<ModeFrame> ModeFrame::of(const Masses& masses) {
  ModeFrame frame;
  std::vector<std::size_t> axes;
  for (std::size_t i = 0; i < kCount; ++i) {
    frame.to_modes_[i][i] = frame.to_axes_[i][i] = 1.0;
    if (masses.stiffness_n_mm[i][i] > 0.0) {
      axes.push_back(i);
    }
  }
  // Newtons per metre, and so rad²/s².
  constexpr double kPerMetre = 1e3;
  const Square mass = picked(masses.mass_kg, axes, 1.0);
  const Square stiffness = picked(masses.stiffness_n_mm, axes, kPerMetre);
  if (axes.empty() || Eigen::LLT<Square>(mass).info() != Eigen::Success) {
    return fail(ErrorKind::input, "something that swings has no mass");
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<Square> solver(stiffness, mass);
  if (solver.info() != Eigen::Success || !(solver.eigenvalues().minCoeff() > 0.0)) {
    return fail(ErrorKind::input, "a motion of the tool meets no stiffness");
  }
  Square vectors = solver.eigenvectors();
  follow_axes(solver.eigenvalues(), mass, vectors);
  const Square damping =
      vectors.transpose() * picked(masses.damping_n_s_mm, axes, kPerMetre) * vectors;
  frame.left_out_ = largest_off_diagonal(damping);
  const std::vector<Eigen::Index> order = order_of(vectors);
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const Eigen::Index of = order[i];
    Eigen::VectorXd direction = vectors.col(of).normalized();
    const double length = vectors.col(of).norm();
    if (direction(static_cast<Eigen::Index>(i)) < 0.0) {
      direction = -direction;
    }
    // A row of T: Φᵀ M with columns of length 1.
    const Eigen::VectorXd row = length * length * (mass * direction);
    const double omega = std::sqrt(solver.eigenvalues()(of));
    const double zeta = damping(of, of) / (2.0 * omega);
    if (zeta >= 1.0) {
      return fail(ErrorKind::input, "a mode is damped so much that it does not swing");
    }
    frame.modes_[axes[i]] = Mode{omega, zeta};
    for (std::size_t k = 0; k < axes.size(); ++k) {
      frame.to_axes_[axes[k]][axes[i]] = direction(static_cast<Eigen::Index>(k));
      frame.to_modes_[axes[i]][axes[k]] = row(static_cast<Eigen::Index>(k));
    }
  }
  return frame;
}

ModeFrame ModeFrame::detuned(double factor) const {
  ModeFrame other = *this;
  for (std::optional<Mode>& mode : other.modes_) {
    if (mode) {
      mode->omega_rad_s *= factor;
    }
  }
  return other;
}

NozzleXY ModeFrame::riding(const Vector& velocity_mm_s) const {
  const Vector velocity = to_modes(velocity_mm_s);
  NozzleXY nozzle;
  for (std::size_t i = 0; i < kCount; ++i) {
    nozzle.x.parts[i].velocity = modes_[i] ? velocity[i] : 0.0;
  }
  return nozzle;
}

void ModeFrame::advance(const Vector& velocity_mm_s, const Vector& accel_mm_s2, double h,
                        NozzleXY& nozzle) const {
  const Vector velocity = to_modes(velocity_mm_s);
  const Vector accel = to_modes(accel_mm_s2);
  for (std::size_t i = 0; i < kCount; ++i) {
    if (modes_[i]) {
      NozzleMotion& part = nozzle.x.parts[i];
      const FlexibleAxis alone(modes_[i]->omega_rad_s, modes_[i]->zeta);
      part = exact_step(alone, {{part}}, {0.0, velocity[i], accel[i]}, h).parts[0];
      part.position -= h * (velocity[i] + 0.5 * accel[i] * h);
    }
  }
}

std::array<NozzleMotion, ModeFrame::kCount> ModeFrame::ahead(const NozzleXY& nozzle) const {
  std::array<NozzleMotion, kCount> result{};
  for (std::size_t i = 0; i < kCount; ++i) {
    for (std::size_t j = 0; j < kCount; ++j) {
      result[i].position += to_axes_[i][j] * nozzle.x.parts[j].position;
      result[i].velocity += to_axes_[i][j] * nozzle.x.parts[j].velocity;
    }
  }
  return result;
}

double ModeFrame::apart_mm(const NozzleXY& a, const NozzleXY& b) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < kCount; ++i) {
    if (modes_[i]) {
      const NozzleMotion& of_a = a.x.parts[i];
      const NozzleMotion& of_b = b.x.parts[i];
      sum += math::square(of_a.position - of_b.position) +
             math::square((of_a.velocity - of_b.velocity) / modes_[i]->omega_rad_s);
    }
  }
  return std::sqrt(sum);
}

}  // namespace unflex::dynamics
