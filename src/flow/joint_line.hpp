// The text of a line of motion whose places are those of joints.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "unflex/gcode/line.hpp"

namespace unflex::flow {

// Joints are written to a tenth of a micrometre, as compensated places are.
inline constexpr int kJointDecimals = 4;
// F, in mm/min.
inline constexpr int kFeedDecimals = 2;

// A joint's place in units of 10^-kJointDecimals mm.
using ScaledJoints = std::array<std::int64_t, 3>;

[[nodiscard]] ScaledJoints scaled_joints(const std::array<double, 3>& joints_mm);

// A line of motion, taken apart. Views point into its text.
struct MotionText {
  std::string_view command;      // G0, or G1 also for an arc
  std::optional<std::string> e;  // the value of E as it was written
  std::string others;            // the words besides X, Y, Z, E, F and those of arcs: " S5"
  std::string_view comment;      // with the blanks before it
  std::string_view ending;       // of the line
};

// The line must be one that its firmware understands as G0 to G3.
[[nodiscard]] MotionText motion_text(const gcode::Line& line, bool is_arc);

// Appends a line but for its ending. Without feed_scaled it has no F.
void append_motion(std::string& text, const MotionText& motion, const ScaledJoints& joints,
                   const std::optional<std::string>& e, std::optional<std::int64_t> feed_scaled);

// The line with F behind its words.
[[nodiscard]] std::string with_feed(const gcode::Line& line, std::int64_t feed_scaled);

// The line with another command in the place of its only word, G91.
[[nodiscard]] std::string with_command(const gcode::Line& line, std::string_view command);

}  // namespace unflex::flow
