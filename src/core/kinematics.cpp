#include "unflex/core/kinematics.hpp"

#include <algorithm>

#include "unflex/core/firmware_spec.hpp"

namespace unflex {
namespace {

constexpr std::array kAll = {Kinematics::cartesian,
                             Kinematics::corexy,
                             Kinematics::corexz,
                             Kinematics::hybrid_corexy,
                             Kinematics::hybrid_corexy_inverted,
                             Kinematics::hybrid_corexz};

}  // namespace

std::string_view to_string(Kinematics kinematics) {
  switch (kinematics) {
    case Kinematics::cartesian:
      return "cartesian";
    case Kinematics::corexy:
      return "corexy";
    case Kinematics::corexz:
      return "corexz";
    case Kinematics::hybrid_corexy:
      return "hybrid_corexy";
    case Kinematics::hybrid_corexy_inverted:
      return "hybrid_corexy_inverted";
    case Kinematics::hybrid_corexz:
      return "hybrid_corexz";
  }
  return "";
}

std::span<const Kinematics> all_kinematics() { return kAll; }

Motors::Motors(Kinematics kinematics, Firmware firmware) {
  const double lift = spec_of(firmware).motion.corexz_lift;
  switch (kinematics) {
    case Kinematics::cartesian:
      break;
    case Kinematics::corexy:
      rows_[0] = {1.0, 1.0, 0.0};
      rows_[1] = {1.0, -1.0, 0.0};
      break;
    case Kinematics::corexz:
      rows_[0] = {1.0, 0.0, lift};
      rows_[2] = {1.0, 0.0, -lift};
      break;
    case Kinematics::hybrid_corexy:
      rows_[0] = {1.0, -1.0, 0.0};
      break;
    case Kinematics::hybrid_corexy_inverted:
      rows_[0] = {1.0, 1.0, 0.0};
      break;
    case Kinematics::hybrid_corexz:
      rows_[0] = {1.0, 0.0, -1.0};
      break;
  }
}

std::array<double, Motors::kCount> Motors::axes(const std::array<double, kCount>& q) const {
  // Cramer's rule: column i of the adjugate is the cross product of the other two rows.
  std::array<double, kCount> result{};
  double determinant = 0.0;
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto& u = rows_[(i + 1) % kCount];
    const auto& v = rows_[(i + 2) % kCount];
    for (std::size_t j = 0; j < kCount; ++j) {
      const std::size_t k = (j + 1) % kCount;
      const std::size_t l = (j + 2) % kCount;
      const double cofactor = u[k] * v[l] - u[l] * v[k];
      result[j] += cofactor * q[i];
      determinant += i == 0 ? cofactor * rows_[0][j] : 0.0;
    }
  }
  for (double& axis : result) {
    axis /= determinant;
  }
  return result;
}

bool Motors::shared_by_xy() const {
  return std::ranges::any_of(rows_, [](const auto& row) { return row[0] != 0.0 && row[1] != 0.0; });
}

double Motors::largest_of_xy(const Axes<double>& xy, double z) const {
  double largest = 0.0;
  for (std::size_t i = 0; i < kCount; ++i) {
    if (moves_xy(i)) {
      largest = std::max(largest, std::abs(of(i, xy.x, xy.y, z)));
    }
  }
  return largest;
}

}  // namespace unflex
