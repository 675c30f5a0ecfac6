#include "unflex/kinematics/linear.hpp"

#include <limits>

namespace unflex::kinematics {

Result<Joints> to_joints(const Linear& machine, const Point& p) {
  Joints q = product(machine.motors.rows(), p);
  for (std::size_t i = 0; i < q.size(); ++i) {
    q[i] += machine.offset_mm[i];
  }
  return q;
}

Result<Point> to_point(const Linear& machine, const Joints& q) {
  Joints from_offset = q;
  for (std::size_t i = 0; i < q.size(); ++i) {
    from_offset[i] -= machine.offset_mm[i];
  }
  return machine.motors.axes(from_offset);
}

Matrix jacobian(const Linear& machine, const Point& /*p*/) { return machine.motors.rows(); }

Joints joint_acceleration(const Linear& machine, const Point& /*p*/, const Point& /*v*/,
                          const Point& a) {
  return product(machine.motors.rows(), a);
}

double longest_line_mm(const Linear& /*machine*/, const Point& /*p*/, const Point& /*direction*/,
                       double /*tolerance_mm*/) {
  return std::numeric_limits<double>::infinity();
}

std::optional<std::string> fault(const Linear& /*machine*/, const Point& /*p*/) {
  return std::nullopt;
}

}  // namespace unflex::kinematics
