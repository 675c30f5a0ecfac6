#include "unflex/kinematics/fit.hpp"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace unflex::kinematics {
namespace {

// How far the tools reach across the plane they are nearest to, as a share of how far they reach
// along it. Below this, an error of measurement would be taken for a property of the machine.
constexpr double kLeastThickness = 0.01;

Eigen::MatrixXd tools_of(std::span<const Pair> pairs) {
  Eigen::MatrixXd tools(pairs.size(), 3);
  for (Eigen::Index k = 0; k < tools.rows(); ++k) {
    const Point& p = pairs[static_cast<std::size_t>(k)].p_mm;
    tools.row(k) << p[0], p[1], p[2];
  }
  return tools;
}

Eigen::MatrixXd joints_of(std::span<const Pair> pairs) {
  Eigen::MatrixXd joints(pairs.size(), 3);
  for (Eigen::Index k = 0; k < joints.rows(); ++k) {
    const Joints& q = pairs[static_cast<std::size_t>(k)].q_mm;
    joints.row(k) << q[0], q[1], q[2];
  }
  return joints;
}

void tell_residuals(Fit& result, const Eigen::MatrixXd& residuals) {
  for (Eigen::Index k = 0; k < residuals.rows(); ++k) {
    result.residuals_mm.push_back({residuals(k, 0), residuals(k, 1), residuals(k, 2)});
  }
  for (std::size_t i = 0; i < result.rms_mm.size(); ++i) {
    const auto column = residuals.col(static_cast<Eigen::Index>(i));
    result.rms_mm[i] = std::sqrt(column.squaredNorm() / static_cast<double>(residuals.rows()));
    result.largest_mm[i] = column.cwiseAbs().maxCoeff();
  }
  result.worst_row =
      static_cast<std::size_t>(std::ranges::max_element(result.rms_mm) - result.rms_mm.begin());
}

}  // namespace

Result<Fit> fit(std::span<const Pair> pairs) {
  if (pairs.size() < kFewestPairs) {
    return fail(ErrorKind::input,
                fmt::format("at least {} places that are not in one plane are needed, and it has "
                            "{}; measure more",
                            kFewestPairs, pairs.size()));
  }
  const Eigen::MatrixXd tools = tools_of(pairs);
  const Eigen::RowVector3d middle = tools.colwise().mean();
  // About their middle, the tools' places say nothing of c, which makes the problem well posed.
  const Eigen::MatrixXd centred = tools.rowwise() - middle;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(centred, Eigen::ComputeThinU | Eigen::ComputeThinV);
  if (!(svd.singularValues()[2] > kLeastThickness * svd.singularValues()[0])) {
    return fail(ErrorKind::input,
                "all its places of the tool lie in a plane, or nearly so; measure some that are "
                "far from it");
  }
  const Eigen::MatrixXd joints = joints_of(pairs);
  const Eigen::RowVector3d joints_middle = joints.colwise().mean();
  const Eigen::MatrixXd centred_joints = joints.rowwise() - joints_middle;
  const Eigen::MatrixXd transposed = svd.solve(centred_joints);
  const Eigen::RowVector3d offset = joints_middle - middle * transposed;
  Fit result;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto row = static_cast<std::size_t>(i);
    result.rows[row] = {transposed(0, i), transposed(1, i), transposed(2, i)};
    result.offset_mm[row] = offset(i);
  }
  tell_residuals(result, centred_joints - centred * transposed);
  if (const std::optional<std::string> fault = Motors::fault(result.rows)) {
    return fail(ErrorKind::input,
                fmt::format("no machine can have the rows that suit these places: {}; look for "
                            "mistaken numbers",
                            *fault));
  }
  return result;
}

}  // namespace unflex::kinematics
