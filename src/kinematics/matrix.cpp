#include "unflex/kinematics/matrix.hpp"

#include <Eigen/Dense>
#include <limits>

namespace unflex::kinematics {
namespace {

using RowMajor = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

RowMajor eigen_of(const Matrix& m) {
  RowMajor result;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      result(i, j) = m[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
    }
  }
  return result;
}

Eigen::Vector3d singular_values(const Matrix& m) {
  return Eigen::JacobiSVD<RowMajor>(eigen_of(m)).singularValues();
}

double over(double numerator, double denominator) {
  return denominator > 0.0 ? numerator / denominator : std::numeric_limits<double>::infinity();
}

}  // namespace

Joints product(const Matrix& m, const Point& x) {
  Joints result{};
  for (std::size_t i = 0; i < m.size(); ++i) {
    result[i] = m[i][0] * x[0] + m[i][1] * x[1] + m[i][2] * x[2];
  }
  return result;
}

Matrix inverse(const Matrix& m) {
  const RowMajor inverted = eigen_of(m).inverse();
  Matrix result{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      result[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)] = inverted(i, j);
    }
  }
  return result;
}

double condition(const Matrix& m) {
  const Eigen::Vector3d values = singular_values(m);
  return over(values[0], values[2]);
}

double norm_of_inverse(const Matrix& m) { return over(1.0, singular_values(m)[2]); }

}  // namespace unflex::kinematics
