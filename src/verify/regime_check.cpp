#include "regime_check.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>
#include <variant>

#include "unflex/planner/limit_rows.hpp"

namespace unflex::verify {
namespace {

// Rounding steps of emitted coordinates (four decimals) and filament (five, and the remainder).
constexpr double kPositionTolerance_mm = 1e-4 + 1e-9;
constexpr double kFilamentTolerance_mm = 2e-5;
constexpr double kRelativeTolerance = 1e-6;

class Differences {
 public:
  void compare(std::string_view what, double input, double output, double tolerance) {
    if (!(std::abs(input - output) <= tolerance)) {
      add(fmt::format("{} is {:.6g} instead of {:.6g}", what, output, input));
    }
  }
  void compare_relative(std::string_view what, double input, double output) {
    compare(what, input, output, kRelativeTolerance * std::abs(input));
  }
  void compare(bool equal, std::string_view what) {
    if (!equal) {
      add(fmt::format("{} differs", what));
    }
  }
  [[nodiscard]] std::string text() const { return text_; }

 private:
  void add(std::string_view difference) {
    text_ += text_.empty() ? "" : ", ";
    text_ += difference;
  }
  std::string text_;
};

}  // namespace

std::string modal_difference(const gcode::ModalState& input, const gcode::ModalState& output) {
  Differences differences;
  constexpr std::array<std::string_view, 3> kNames = {"X", "Y", "Z"};
  for (std::size_t axis = 0; axis < kNames.size(); ++axis) {
    differences.compare(kNames[axis], input.position_mm[axis], output.position_mm[axis],
                        kPositionTolerance_mm);
    differences.compare(fmt::format("{} origin", kNames[axis]), input.base_mm[axis],
                        output.base_mm[axis], kPositionTolerance_mm);
    differences.compare(input.known[axis] == output.known[axis],
                        fmt::format("whether {} is known", kNames[axis]));
  }
  if (input.e_is_absolute()) {
    differences.compare("E", input.position_mm[gcode::E] - input.base_mm[gcode::E],
                        output.position_mm[gcode::E] - output.base_mm[gcode::E],
                        kFilamentTolerance_mm);
  }
  differences.compare(input.absolute_xyz == output.absolute_xyz, "G90/G91");
  differences.compare(input.e_is_absolute() == output.e_is_absolute(), "M82/M83");
  differences.compare(input.plane == output.plane, "plane (G17 to G19)");
  differences.compare(input.retraction.retracted == output.retraction.retracted,
                      "firmware retraction");
  differences.compare_relative("unit", input.unit_mm, output.unit_mm);
  differences.compare_relative("feed rate", input.feed_mm_s, output.feed_mm_s);
  differences.compare_relative("speed factor", input.speed_factor, output.speed_factor);
  differences.compare_relative("flow factor", input.filament_factor(), output.filament_factor());
  return differences.text();
}

namespace {

using Rows = std::span<const planner::LimitRow>;

bool is_of_axes(const planner::LimitRow& row) {
  return std::holds_alternative<planner::AxisLimit>(row.member);
}

// Rows of axes, axis by axis.
void compare_axes(Rows rows, const planner::Limits& input, const planner::Limits& output,
                  Differences& differences) {
  constexpr std::array<std::string_view, 4> kAxes = {"X", "Y", "Z", "E"};
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    for (const planner::LimitRow& row : rows) {
      const auto member = std::get<planner::AxisLimit>(row.member).in_force;
      const double before = (input.*member)[axis];
      const double after = (output.*member)[axis];
      // Both may be infinite.
      if (before != after) {
        differences.compare_relative(fmt::format(fmt::runtime(row.word), kAxes[axis]), before,
                                     after);
      }
    }
  }
}

}  // namespace

std::string limits_difference(const planner::Limits& input, const planner::Limits& output) {
  Differences differences;
  const Rows rows = planner::limit_rows();
  for (auto row = rows.begin(); row != rows.end();) {
    if (is_of_axes(*row)) {
      const auto end = std::find_if_not(row, rows.end(), is_of_axes);
      compare_axes({row, end}, input, output, differences);
      row = end;
      continue;
    }
    if (const auto* shared = std::get_if<planner::SharedLimit>(&row->member)) {
      differences.compare_relative(row->word, input.*shared->in_force, output.*shared->in_force);
    } else if (const auto* choice = std::get_if<planner::ChoiceLimit>(&row->member)) {
      differences.compare(input.*choice->in_force == output.*choice->in_force, row->word);
    }
    ++row;
  }
  return differences.text();
}

}  // namespace unflex::verify
