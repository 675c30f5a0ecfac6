#include "unflex/core/kinematics.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "unflex/core/firmware_spec.hpp"
#include "unflex/core/math.hpp"

namespace unflex {
namespace {

constexpr std::array kAll = {Kinematics::cartesian,
                             Kinematics::corexy,
                             Kinematics::corexz,
                             Kinematics::hybrid_corexy,
                             Kinematics::hybrid_corexy_inverted,
                             Kinematics::hybrid_corexz,
                             Kinematics::tripteron,
                             Kinematics::linear};

constexpr std::array<std::string_view, Motors::kCount> kLetters = {"A", "B", "C"};

// Column i of the adjugate is the cross product of the other two rows.
Motors::Rows adjugate(const Motors::Rows& rows) {
  constexpr std::size_t kCount = Motors::kCount;
  Motors::Rows result{};
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto& u = rows[(i + 1) % kCount];
    const auto& v = rows[(i + 2) % kCount];
    for (std::size_t j = 0; j < kCount; ++j) {
      const std::size_t k = (j + 1) % kCount;
      const std::size_t l = (j + 2) % kCount;
      result[j][i] = u[k] * v[l] - u[l] * v[k];
    }
  }
  return result;
}

double determinant_of(const Motors::Rows& rows, const Motors::Rows& adjugate) {
  double determinant = 0.0;
  for (std::size_t j = 0; j < rows.size(); ++j) {
    determinant += adjugate[j][0] * rows[0][j];
  }
  return determinant;
}

// The largest singular value over the smallest one: the root of that ratio of the eigenvalues of
// the rows' products (Smith, Eigenvalues of a symmetric 3 × 3 matrix, Comm. ACM 4 (1961) 168).
double condition_of(const Motors::Rows& rows) {
  Motors::Rows a{};
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < a.size(); ++j) {
      for (std::size_t k = 0; k < a.size(); ++k) {
        a[i][j] += rows[i][k] * rows[j][k];
      }
    }
  }
  const double mean = (a[0][0] + a[1][1] + a[2][2]) / 3.0;
  double spread2 = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    a[i][i] -= mean;
    for (std::size_t j = 0; j < a.size(); ++j) {
      spread2 += a[i][j] * a[i][j] / 6.0;
    }
  }
  const double spread = std::sqrt(spread2);
  if (spread <= 1e-12 * mean) {
    return 1.0;
  }
  const double half_determinant = 0.5 * determinant_of(a, adjugate(a)) / (spread2 * spread);
  const double cosine = std::clamp(half_determinant, -1.0, 1.0);
  const double angle = math::atan2(std::sqrt(1.0 - cosine * cosine), cosine) / 3.0;
  const double largest = mean + 2.0 * spread * math::cos(angle);
  const double smallest = mean + 2.0 * spread * math::cos(angle + 2.0 * std::numbers::pi / 3.0);
  return std::sqrt(largest / std::max(smallest, 1e-12 * largest));
}

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
    case Kinematics::tripteron:
      return "tripteron";
    case Kinematics::linear:
      return "linear";
  }
  return "";
}

std::span<const Kinematics> all_kinematics() { return kAll; }

Motors::Motors(Kinematics kinematics, Firmware firmware) {
  const double lift = spec_of(firmware).motion.corexz_lift;
  switch (kinematics) {
    case Kinematics::cartesian:
    case Kinematics::linear:
      break;
    case Kinematics::corexy:
      rows_[0] = {1.0, 1.0, 0.0};
      rows_[1] = {1.0, -1.0, 0.0};
      names_ = {"A", "B", "Z"};
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
    case Kinematics::tripteron:
      rows_ = {{{1.0, 1.0, -1.0}, {1.0, -1.0, -1.0}, {1.0, 0.0, 1.0}}};
      names_ = kLetters;
      break;
  }
}

Motors::Motors(const Rows& rows) : rows_(rows), names_(kLetters) {}

std::optional<std::string> Motors::fault(const Rows& rows) {
  constexpr double kLeastDeterminant = 1e-3;
  constexpr double kMostCondition = 20.0;
  const double determinant = determinant_of(rows, adjugate(rows));
  if (!(std::abs(determinant) >= kLeastDeterminant)) {
    return fmt::format(
        "its motors do not move X, Y and Z independently: the matrix' determinant is {:.3g}, and "
        "must be at least {}",
        determinant, kLeastDeterminant);
  }
  const double condition = condition_of(rows);
  if (!(condition <= kMostCondition)) {
    return fmt::format(
        "its motors hardly move X, Y and Z independently: one way takes {:.3g} times the travel of "
        "another, and {} are allowed",
        condition, kMostCondition);
  }
  return std::nullopt;
}

Motors::Rows Motors::inverse() const {
  Rows result = adjugate(rows_);
  const double determinant = determinant_of(rows_, result);
  for (Row& row : result) {
    for (double& share : row) {
      share /= determinant;
    }
  }
  return result;
}

std::array<double, Motors::kCount> Motors::axes(const std::array<double, kCount>& q) const {
  const Rows share = adjugate(rows_);
  const double determinant = determinant_of(rows_, share);
  std::array<double, kCount> result{};
  for (std::size_t axis = 0; axis < kCount; ++axis) {
    for (std::size_t motor = 0; motor < kCount; ++motor) {
      result[axis] += share[axis][motor] * q[motor];
    }
    result[axis] /= determinant;
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

double Motors::gain_of_xy() const {
  double gain = 0.0;
  for (const Row& row : rows_) {
    gain = std::max({gain, std::abs(row[0]), std::abs(row[1])});
  }
  return gain;
}

double Motors::gain_of_both() const {
  double gain = 0.0;
  for (const Row& row : rows_) {
    gain = std::max(gain, std::abs(row[0]) + std::abs(row[1]));
  }
  return gain;
}

}  // namespace unflex
