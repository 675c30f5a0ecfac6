#include "unflex/kinematics/tripteron.hpp"

#include <fmt/core.h>

#include <cmath>
#include <numbers>

#include "unflex/core/math.hpp"

namespace unflex::kinematics {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180.0;

// D² = L₁² + L₂² + 2 L₁ L₂ cos(elbow)
double length_at_mm(const Bars& bars, double elbow_rad) {
  return std::sqrt(bars.upper_mm * bars.upper_mm + bars.lower_mm * bars.lower_mm +
                   2.0 * bars.upper_mm * bars.lower_mm * math::cos(elbow_rad));
}

// The shortest and the longest that a leg may be. A straight or folded leg is computed without the
// cosine, whose rounding would leave a part of a nanometre of the folded leg.
double shortest_mm(const Bars& bars) {
  return bars.most_elbow_rad >= std::numbers::pi ? std::abs(bars.upper_mm - bars.lower_mm)
                                                 : length_at_mm(bars, bars.most_elbow_rad);
}

double longest_mm(const Bars& bars) {
  return bars.least_elbow_rad <= 0.0 ? bars.upper_mm + bars.lower_mm
                                     : length_at_mm(bars, bars.least_elbow_rad);
}

std::string limit_text(double elbow_rad, std::string_view singular) {
  const bool is_singular = elbow_rad <= 0.0 || elbow_rad >= std::numbers::pi;
  return is_singular ? std::string(singular)
                     : fmt::format("its elbow is at {:.6g}°", elbow_rad / kDegree_rad);
}

}  // namespace

Motors::Row row_of_rail(double tilt_rad, double azimuth_rad, bool leans_back) {
  const double along_z = math::cos(tilt_rad) / (math::sin(tilt_rad) * math::cos(azimuth_rad));
  return {1.0, math::sin(azimuth_rad) / math::cos(azimuth_rad), leans_back ? -along_z : along_z};
}

Joints offset_of_legs(const Motors::Rows& rows, const std::array<Leg, Motors::kCount>& legs) {
  Joints offset{};
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const auto& [x, y, z] = legs[i].tool_joint_mm;
    offset[i] = rows[i][0] * x + rows[i][1] * (y - legs[i].rail_y_mm) +
                rows[i][2] * (z - legs[i].rail_z_mm);
  }
  return offset;
}

double length_of_leg_mm(const Tripteron& machine, std::size_t i, const Point& p) {
  // n is along the row of J. With n·Δ = 0 it gives Δ_x.
  const Motors::Row& n = machine.linear.motors.rows()[i];
  const Leg& leg = machine.legs[i];
  const double dy = p[1] + leg.tool_joint_mm[1] - leg.rail_y_mm;
  const double dz = p[2] + leg.tool_joint_mm[2] - leg.rail_z_mm;
  const double dx = -(n[1] * dy + n[2] * dz) / n[0];
  return std::sqrt(dx * dx + dy * dy + dz * dz);
}

Result<Joints> to_joints(const Tripteron& machine, const Point& p) {
  return to_joints(machine.linear, p);
}

Result<Point> to_point(const Tripteron& machine, const Joints& q) {
  return to_point(machine.linear, q);
}

Matrix jacobian(const Tripteron& machine, const Point& p) { return jacobian(machine.linear, p); }

Joints joint_acceleration(const Tripteron& machine, const Point& p, const Point& v,
                          const Point& a) {
  return joint_acceleration(machine.linear, p, v, a);
}

double longest_line_mm(const Tripteron& machine, const Point& p, const Point& direction,
                       double tolerance_mm) {
  return longest_line_mm(machine.linear, p, direction, tolerance_mm);
}

std::optional<std::string> fault(const Tripteron& machine, const Point& p) {
  const double shortest = shortest_mm(machine.bars);
  const double longest = longest_mm(machine.bars);
  for (std::size_t i = 0; i < machine.legs.size(); ++i) {
    const double length = length_of_leg_mm(machine, i, p);
    const std::string_view name = machine.linear.motors.names()[i];
    if (length > longest) {
      return fmt::format("leg {} would have to be {:.6g} mm long, and {} at {:.6g} mm", name,
                         length, limit_text(machine.bars.least_elbow_rad, "it is straight"),
                         longest);
    }
    if (length < shortest) {
      return fmt::format("leg {} would have to be {:.6g} mm long, and {} at {:.6g} mm", name,
                         length, limit_text(machine.bars.most_elbow_rad, "it is folded"), shortest);
    }
  }
  return std::nullopt;
}

}  // namespace unflex::kinematics
