// The tripteron with parallel rails: three sliders on rails along X, and on each a leg of two bars
// whose three joints have parallel axes of direction n, so that the leg stays in a plane that
// travels with the slider.
//
//   S = (q, y₀, z₀)  slider's joint     T = p + t  tool's joint     Δ = T − S
//   n·Δ = 0  ⇒  q = p_x + (n_y/n_x) p_y + (n_z/n_x) p_z + n·(t − (0, y₀, z₀))/n_x
//
// Its joints move as those of a linear machine do. What it has besides is the reach of the legs:
// D = |Δ| must suit the bars.
//
// Kong, Gosselin: Kinematics and singularity analysis of a novel type of 3-CRR 3-DOF translational
// parallel manipulator, Int. J. Robotics Research 21 (2002) 791.
#pragma once

#include <array>
#include <numbers>
#include <optional>
#include <string>

#include "unflex/kinematics/linear.hpp"

namespace unflex::kinematics {

// The row of a motor whose slider runs on a rail along X and carries a leg of two bars. The plane
// of the leg is tilted against the horizontal by tilt_rad, in (0, π/2), and its normal is turned
// against the rail by azimuth_rad, in (−π/2, π/2). leans_back: the slider lies towards −X below the
// tool.
//
//   row = (1, tan ψ, ∓ cot τ / cos ψ)     τ  tilt     ψ  azimuth     −: leans_back
[[nodiscard]] Motors::Row row_of_rail(double tilt_rad, double azimuth_rad, bool leans_back);

// Where a leg's rail is, and where the leg holds the tool.
struct Leg {
  double rail_y_mm = 0.0;
  double rail_z_mm = 0.0;
  Point tool_joint_mm{};  // t: from the nozzle to the leg's joint on the tool
};

// The bars of all three legs. The elbow's angle is 0 where a leg is straight and π where it is
// folded.
struct Bars {
  double upper_mm = 0.0;  // L₁, at the slider
  double lower_mm = 0.0;  // L₂, at the tool
  double least_elbow_rad = 0.0;
  double most_elbow_rad = std::numbers::pi;
};

struct Tripteron {
  Linear linear;
  std::array<Leg, Motors::kCount> legs;
  Bars bars;

  static constexpr bool kIsUniform = true;
};

// c, mm: the joints where the tool is at 0, 0, 0, by the equation above. Where a row's first number
// is not 1, its motor is geared to the slider, and so is its c.
[[nodiscard]] Joints offset_of_legs(const Motors::Rows& rows,
                                    const std::array<Leg, Motors::kCount>& legs);

// D of leg i, mm. It does not depend on X.
[[nodiscard]] double length_of_leg_mm(const Tripteron& machine, std::size_t i, const Point& p);

[[nodiscard]] Result<Joints> to_joints(const Tripteron& machine, const Point& p);
[[nodiscard]] Result<Point> to_point(const Tripteron& machine, const Joints& q);
[[nodiscard]] Matrix jacobian(const Tripteron& machine, const Point& p);
[[nodiscard]] Joints joint_acceleration(const Tripteron& machine, const Point& p, const Point& v,
                                        const Point& a);
[[nodiscard]] double longest_line_mm(const Tripteron& machine, const Point& p,
                                     const Point& direction, double tolerance_mm);
// A leg that is too short or too long, or whose elbow is beyond its limits. At the elbow's angles 0
// and π the leg is singular.
[[nodiscard]] std::optional<std::string> fault(const Tripteron& machine, const Point& p);

}  // namespace unflex::kinematics
