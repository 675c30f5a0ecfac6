// What a machine's joints do where its tool is.
//
// A further kind of machine is a file of its own with these functions, and a word in Mechanism.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "unflex/core/error.hpp"
#include "unflex/kinematics/delta.hpp"
#include "unflex/kinematics/linear.hpp"
#include "unflex/kinematics/tripteron.hpp"

namespace unflex::kinematics {

using Mechanism = std::variant<Linear, Tripteron, Delta>;

// Where a joint may be, mm.
struct JointRange {
  double min_mm = 0.0;
  double max_mm = 0.0;
};

struct Machine {
  Mechanism mechanism;
  std::array<std::optional<JointRange>, 3> ranges_mm;  // unset: not limited
};

// "A", "B", "C", or as the motors of a linear machine are called.
[[nodiscard]] std::array<std::string_view, 3> joint_names(const Machine& machine);
// Whether J is the same everywhere.
[[nodiscard]] bool is_uniform(const Machine& machine);

// q, mm, for a tool at p, mm. An error of kind input where no place of the joints brings the tool
// there. A place with joints may still have a fault().
[[nodiscard]] Result<Joints> to_joints(const Machine& machine, const Point& p);
// p, mm, for joints at q, mm; the inverse of to_joints(). An error of kind input where there is
// none.
[[nodiscard]] Result<Point> to_point(const Machine& machine, const Joints& q);
// J at p.
[[nodiscard]] Matrix jacobian(const Machine& machine, const Point& p);
// q̇, mm/s, of a tool at p, mm, with the velocity v, mm/s.
[[nodiscard]] Joints joint_velocity(const Machine& machine, const Point& p, const Point& v);
// q̈, mm/s², of a tool at p, mm, with the velocity v, mm/s, and the acceleration a, mm/s².
[[nodiscard]] Joints joint_acceleration(const Machine& machine, const Point& p, const Point& v,
                                        const Point& a);
// How long a line from p may be so that a motion that is straight in the joints leaves it by no
// more than the tolerance, mm. direction: of any length but 0. Infinite where J is constant; 0
// where p has a fault.
[[nodiscard]] double longest_line_mm(const Machine& machine, const Point& p, const Point& direction,
                                     double tolerance_mm);
// Why the tool cannot be at p, mm: the reach of a leg, the range of a joint, or a place that is
// nearly singular. nullopt if it can.
[[nodiscard]] std::optional<std::string> fault(const Machine& machine, const Point& p);

}  // namespace unflex::kinematics
