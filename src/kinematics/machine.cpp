#include "unflex/kinematics/machine.hpp"

#include <fmt/core.h>

namespace unflex::kinematics {
namespace {

// Joints may be beyond their range by as much as numbers are rounded.
constexpr double kOnTheEdge_mm = 1e-6;

std::array<std::string_view, 3> names_of(const Linear& machine) { return machine.motors.names(); }
std::array<std::string_view, 3> names_of(const Tripteron& machine) {
  return names_of(machine.linear);
}
std::array<std::string_view, 3> names_of(const Delta& /*machine*/) { return {"A", "B", "C"}; }

std::optional<std::string> range_fault(const Machine& machine, const Joints& q) {
  for (std::size_t i = 0; i < q.size(); ++i) {
    const std::optional<JointRange>& range = machine.ranges_mm[i];
    if (range && (q[i] < range->min_mm - kOnTheEdge_mm || q[i] > range->max_mm + kOnTheEdge_mm)) {
      return fmt::format(
          "joint {} would have to be at {:.6g} mm, and its range is {:.6g} to {:.6g}",
          joint_names(machine)[i], q[i], range->min_mm, range->max_mm);
    }
  }
  return std::nullopt;
}

}  // namespace

std::array<std::string_view, 3> joint_names(const Machine& machine) {
  return std::visit([](const auto& kind) { return names_of(kind); }, machine.mechanism);
}

bool is_uniform(const Machine& machine) {
  return std::visit([](const auto& kind) { return kind.kIsUniform; }, machine.mechanism);
}

Result<Joints> to_joints(const Machine& machine, const Point& p) {
  return std::visit([&](const auto& kind) { return to_joints(kind, p); }, machine.mechanism);
}

Result<Point> to_point(const Machine& machine, const Joints& q) {
  return std::visit([&](const auto& kind) { return to_point(kind, q); }, machine.mechanism);
}

Matrix jacobian(const Machine& machine, const Point& p) {
  return std::visit([&](const auto& kind) { return jacobian(kind, p); }, machine.mechanism);
}

Joints joint_velocity(const Machine& machine, const Point& p, const Point& v) {
  return product(jacobian(machine, p), v);
}

Joints joint_acceleration(const Machine& machine, const Point& p, const Point& v, const Point& a) {
  return std::visit([&](const auto& kind) { return joint_acceleration(kind, p, v, a); },
                    machine.mechanism);
}

double longest_line_mm(const Machine& machine, const Point& p, const Point& direction,
                       double tolerance_mm) {
  return std::visit(
      [&](const auto& kind) { return longest_line_mm(kind, p, direction, tolerance_mm); },
      machine.mechanism);
}

std::optional<std::string> fault(const Machine& machine, const Point& p) {
  if (auto reach =
          std::visit([&](const auto& kind) { return fault(kind, p); }, machine.mechanism)) {
    return reach;
  }
  const Result<Joints> q = to_joints(machine, p);
  return q ? range_fault(machine, *q) : q.error().message;
}

}  // namespace unflex::kinematics
