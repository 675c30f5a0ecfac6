// A move of the tool as lines that are straight in the joints.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/kinematics/machine.hpp"

namespace unflex::flow {

// A line from where the one before ends.
struct ToolLine {
  kinematics::Point end_mm{};
  kinematics::Joints end_joints_mm{};
  double length_mm = 0.0;
  double share_of_e = 1.0;  // of the whole move's filament, up to the line's end
};

// Why the tool cannot be there; nullopt if it can.
[[nodiscard]] std::optional<std::string> why_not_at(const kinematics::Machine& machine,
                                                    const kinematics::Point& p);

[[nodiscard]] kinematics::Point place_of(const gcode::Position& position);

[[nodiscard]] bool moves_tool(const gcode::Event& event);

// The lines of a move, at least one. Where J changes they are so short that the tool leaves the
// sliced line by no more than the tolerance. Errors are texts: why the tool cannot go there.
[[nodiscard]] tl::expected<std::vector<ToolLine>, std::string> tool_lines(
    const kinematics::Machine& machine, const std::vector<gcode::Segment>& segments,
    double tolerance_mm);

}  // namespace unflex::flow
