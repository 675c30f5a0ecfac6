// Machines whose joints move by the same linear map everywhere.
//
//   q = J p + c     q̇ = J v     q̈ = J a     p = J⁻¹ (q − c)
#pragma once

#include <optional>
#include <string>

#include "unflex/core/error.hpp"
#include "unflex/kinematics/matrix.hpp"

namespace unflex::kinematics {

struct Linear {
  Motors motors;       // J
  Joints offset_mm{};  // c: where the joints are when the tool is at 0, 0, 0

  static constexpr bool kIsUniform = true;  // J is the same everywhere
};

// What each kind of machine answers is told in machine.hpp.
[[nodiscard]] Result<Joints> to_joints(const Linear& machine, const Point& p);
[[nodiscard]] Result<Point> to_point(const Linear& machine, const Joints& q);
[[nodiscard]] Matrix jacobian(const Linear& machine, const Point& p);
[[nodiscard]] Joints joint_acceleration(const Linear& machine, const Point& p, const Point& v,
                                        const Point& a);
[[nodiscard]] double longest_line_mm(const Linear& machine, const Point& p, const Point& direction,
                                     double tolerance_mm);
[[nodiscard]] std::optional<std::string> fault(const Linear& machine, const Point& p);

}  // namespace unflex::kinematics
