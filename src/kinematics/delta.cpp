#include "unflex/kinematics/delta.hpp"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "unflex/core/math.hpp"

namespace unflex::kinematics {
namespace {

constexpr std::array<char, 3> kNames = {'A', 'B', 'C'};

// A rod as the tool sees it. w_mm is not a number if the rod is too short.
struct Rod {
  double dx_mm = 0.0;
  double dy_mm = 0.0;
  double w_mm = 0.0;
};

Rod rod_at(const Tower& tower, const Point& p) {
  const double dx = p[0] - tower.x_mm;
  const double dy = p[1] - tower.y_mm;
  return {dx, dy, std::sqrt(tower.rod_mm * tower.rod_mm - dx * dx - dy * dy)};
}

bool is_flat(const Rod& rod, const Tower& tower) {
  return !(rod.w_mm >= kLeastRise * tower.rod_mm);
}

}  // namespace

Delta delta_on_circle(double radius_mm, double rod_mm, const std::array<double, 3>& angles_rad) {
  Delta machine;
  for (std::size_t i = 0; i < angles_rad.size(); ++i) {
    machine.towers[i] = {radius_mm * math::cos(angles_rad[i]), radius_mm * math::sin(angles_rad[i]),
                         rod_mm};
  }
  return machine;
}

Result<Joints> to_joints(const Delta& machine, const Point& p) {
  Joints q{};
  for (std::size_t i = 0; i < q.size(); ++i) {
    q[i] = p[2] + rod_at(machine.towers[i], p).w_mm;
    if (!std::isfinite(q[i])) {
      return fail(ErrorKind::input, *fault(machine, p));
    }
  }
  return q;
}

// With the first carriage as origin, e_x towards the second, and e_y in the plane of all three.
Result<Point> to_point(const Delta& machine, const Joints& q) {
  using Eigen::Vector3d;
  std::array<Vector3d, 3> carriage;
  std::array<double, 3> rod2{};
  for (std::size_t i = 0; i < q.size(); ++i) {
    const Tower& tower = machine.towers[i];
    carriage[i] = {tower.x_mm, tower.y_mm, q[i]};
    rod2[i] = tower.rod_mm * tower.rod_mm;
  }
  const Vector3d to_second = carriage[1] - carriage[0];
  const Vector3d to_third = carriage[2] - carriage[0];
  const double d = to_second.norm();
  const Vector3d ex = to_second / d;
  const double i = ex.dot(to_third);
  const double j = (to_third - i * ex).norm();
  const Vector3d ey = (to_third - i * ex) / j;
  const double x = (rod2[0] - rod2[1] + d * d) / (2.0 * d);
  const double y = (rod2[0] - rod2[2] + i * i + j * j - 2.0 * i * x) / (2.0 * j);
  const double z = std::sqrt(rod2[0] - x * x - y * y);
  if (!std::isfinite(z)) {
    return fail(ErrorKind::input,
                fmt::format("no place is a rod away from the carriages at {:.6g}, {:.6g} and "
                            "{:.6g} mm; they are too far from each other",
                            q[0], q[1], q[2]));
  }
  Vector3d ez = ex.cross(ey);
  ez = ez.z() > 0.0 ? Vector3d(-ez) : ez;
  const Vector3d p = carriage[0] + x * ex + y * ey + z * ez;
  return Point{p.x(), p.y(), p.z()};
}

Matrix jacobian(const Delta& machine, const Point& p) {
  Matrix rows{};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Rod rod = rod_at(machine.towers[i], p);
    rows[i] = {-rod.dx_mm / rod.w_mm, -rod.dy_mm / rod.w_mm, 1.0};
  }
  return rows;
}

Joints joint_acceleration(const Delta& machine, const Point& p, const Point& v, const Point& a) {
  Joints result{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    const Rod rod = rod_at(machine.towers[i], p);
    const double along_v = rod.dx_mm * v[0] + rod.dy_mm * v[1];
    const double along_a = rod.dx_mm * a[0] + rod.dy_mm * a[1];
    result[i] = a[2] - (along_a + v[0] * v[0] + v[1] * v[1]) / rod.w_mm -
                along_v * along_v / (rod.w_mm * rod.w_mm * rod.w_mm);
  }
  return result;
}

double bend_of_line(const Delta& machine, const Point& p, const Point& u) {
  if (fault(machine, p)) {
    return std::numeric_limits<double>::infinity();
  }
  double largest = 0.0;
  for (const Tower& tower : machine.towers) {
    const Rod rod = rod_at(tower, p);
    const double slope = -(rod.dx_mm * u[0] + rod.dy_mm * u[1]) / rod.w_mm;
    largest = std::max(largest, (u[0] * u[0] + u[1] * u[1] + slope * slope) / rod.w_mm);
  }
  return norm_of_inverse(jacobian(machine, p)) * largest;
}

double longest_line_mm(const Delta& machine, const Point& p, const Point& direction,
                       double tolerance_mm) {
  const double norm = math::hypot(math::hypot(direction[0], direction[1]), direction[2]);
  const Point u = {direction[0] / norm, direction[1] / norm, direction[2] / norm};
  const auto length_at = [&](double s) {
    const double bend =
        std::sqrt(3.0) *
        bend_of_line(machine, {p[0] + s * u[0], p[1] + s * u[1], p[2] + s * u[2]}, u);
    return bend > 0.0 ? std::sqrt(8.0 * tolerance_mm / bend)
                      : std::numeric_limits<double>::infinity();
  };
  double length = length_at(0.0);
  if (!std::isfinite(length)) {
    return length;  // straight up
  }
  // Where the line's end bends it more, a shorter line is tried. Far less than a micrometre is not
  // worth further tries.
  constexpr double kShortest_mm = 1e-6;
  while (length > kShortest_mm) {
    const double allowed = std::min(length_at(0.5 * length), length_at(length));
    if (allowed >= length) {
      return length;
    }
    length = std::max(allowed, 0.5 * length);
  }
  return 0.0;
}

std::optional<std::string> fault(const Delta& machine, const Point& p) {
  for (std::size_t i = 0; i < machine.towers.size(); ++i) {
    const Tower& tower = machine.towers[i];
    const Rod rod = rod_at(tower, p);
    if (is_flat(rod, tower)) {
      return fmt::format(
          "the rod of tower {} would have to reach {:.6g} mm sideways, and its {:.6g} "
          "mm are safe up to {:.6g} mm",
          kNames[i], math::hypot(rod.dx_mm, rod.dy_mm), tower.rod_mm,
          tower.rod_mm * std::sqrt(1.0 - kLeastRise * kLeastRise));
    }
  }
  return std::nullopt;
}

}  // namespace unflex::kinematics
