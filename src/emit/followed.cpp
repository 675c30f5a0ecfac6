#include "followed.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "unflex/core/math.hpp"
#include "unflex/dynamics/node_map.hpp"

namespace unflex::emit {
namespace {

using dynamics::Mode;
using dynamics::NozzleMotion;
using dynamics::NozzleState;

// ∫ q_i q_j of two modes that ring down, by the states of both: AᵢᵀX + XAⱼ + E = 0, where E takes
// the product of the positions.
Eigen::Matrix2d ring_down_product(const Mode& a, const Mode& b) {
  const auto rate = [](const Mode& mode) {
    constexpr double kLeastZeta = 0.01;
    const double omega = mode.omega_rad_s;
    Eigen::Matrix2d matrix;
    matrix << 0.0, 1.0, -omega * omega, -2.0 * std::max(mode.zeta, kLeastZeta) * omega;
    return matrix;
  };
  const Eigen::Matrix2d of_a = rate(a);
  const Eigen::Matrix2d of_b = rate(b);
  Eigen::Matrix4d equations = Eigen::Matrix4d::Zero();  // for X by columns
  for (Eigen::Index column = 0; column < 2; ++column) {
    equations.block<2, 2>(2 * column, 2 * column) += of_a.transpose();
    for (Eigen::Index other = 0; other < 2; ++other) {
      equations.block<2, 2>(2 * column, 2 * other) +=
          of_b(other, column) * Eigen::Matrix2d::Identity();
    }
  }
  const Eigen::Vector4d solution =
      equations.fullPivLu().solve(Eigen::Vector4d(-Eigen::Vector4d::UnitX()));
  return Eigen::Map<const Eigen::Matrix2d>(solution.data());
}

Eigen::Matrix2d ring_down_of(const Mode& mode) {
  const double omega = mode.omega_rad_s;
  const double zeta = std::max(mode.zeta, 0.01);
  const double mixed = 0.5 / (omega * omega);
  Eigen::Matrix2d result;
  result << (1.0 + 4.0 * zeta * zeta) / (4.0 * zeta * omega), mixed, mixed,
      1.0 / (4.0 * zeta * math::power(omega, 3));
  return result;
}

}  // namespace

StepMatrix::StepMatrix(const dynamics::FlexibleAxis& axis, std::size_t mode, double dt) : dt_(dt) {
  if (mode >= axis.mode_count()) {
    return;
  }
  gain_ = axis.modes()[mode].gain;
  const dynamics::FlexibleAxis alone(axis.modes().subspan(mode, 1));
  const auto column = [&](int i, const NozzleState& from, const dynamics::BaseSegment& base) {
    const NozzleMotion to = dynamics::exact_step(alone, from, base, dt).parts[0];
    columns_.col(i) << to.position, to.velocity;
  };
  column(0, {{NozzleMotion{1.0, 0.0}}}, {});
  column(1, {{NozzleMotion{0.0, 1.0}}}, {});
  column(2, {}, {1.0, 0.0, 0.0});
  column(3, {}, {0.0, 1.0, 0.0});
}

Followed::Followed(const dynamics::BaseTrajectory& base, std::size_t axis,
                   const dynamics::FlexibleAxis& nozzle)
    : Followed(base, axis, nozzle,
               nozzle.riding(base.at(base[axis], 0.0).position_mm,
                             base.at(base[axis], 0.0).velocity_mm_s)) {}

Followed::Followed(const dynamics::BaseTrajectory& base, std::size_t axis,
                   const dynamics::FlexibleAxis& nozzle, const NozzleState& start)
    : modes_(nozzle.mode_count()), period_s_(base.period_s) {
  const dynamics::NodeMap map(nozzle, base.period_s);
  parts_.reserve(modes_ * base.nodes());
  NozzleState state = start;
  note(state);
  for (std::size_t k = 0; k + 1 < base.nodes(); ++k) {
    map.advance(base[axis], k, state);
    note(state);
  }
}

void Followed::note(const NozzleState& state) {
  parts_.insert(parts_.end(), state.parts.begin(),
                state.parts.begin() + static_cast<std::ptrdiff_t>(modes_));
}

// Interpolates by cubics between the nodes.
NozzleState Followed::at(double t) const {
  const double scaled = t / period_s_;
  const std::size_t last = parts_.size() / modes_ - 2;
  const std::size_t k = std::min(static_cast<std::size_t>(std::max(scaled, 0.0)), last);
  const double s = scaled - static_cast<double>(k);
  NozzleState result;
  for (std::size_t mode = 0; mode < modes_; ++mode) {
    const NozzleMotion& a = parts_[k * modes_ + mode];
    const NozzleMotion& b = parts_[(k + 1) * modes_ + mode];
    const double rise = b.position - a.position;
    const double va = a.velocity * period_s_;
    const double vb = b.velocity * period_s_;
    const double square = 3.0 * rise - 2.0 * va - vb;
    const double cube = va + vb - 2.0 * rise;
    result.parts[mode] = {a.position + s * (va + s * (square + s * cube)),
                          (va + s * (2.0 * square + 3.0 * s * cube)) / period_s_};
  }
  return result;
}

template <int kModes>
ModesSquare<kModes> ring_down_square(const dynamics::FlexibleAxis& axis) {
  ModesSquare<kModes> result = ModesSquare<kModes>::Zero();
  const std::size_t count = axis.mode_count();
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) {
      result.template block<2, 2>(static_cast<Eigen::Index>(2 * i),
                                  static_cast<Eigen::Index>(2 * j)) =
          i == j ? ring_down_of(axis.modes()[i])
                 : ring_down_product(axis.modes()[i], axis.modes()[j]);
    }
  }
  return result;
}

template ModesSquare<1> ring_down_square<1>(const dynamics::FlexibleAxis&);
template ModesSquare<2> ring_down_square<2>(const dynamics::FlexibleAxis&);
template ModesSquare<3> ring_down_square<3>(const dynamics::FlexibleAxis&);

}  // namespace unflex::emit
