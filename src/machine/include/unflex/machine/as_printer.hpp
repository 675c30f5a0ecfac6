// The settings in the form that the interpreter, the planner and the models of axes and hotend
// take.
#pragma once

#include <vector>

#include "unflex/dynamics/flexible_axis.hpp"
#include "unflex/dynamics/frequency_field.hpp"
#include "unflex/dynamics/hotend_pressure.hpp"
#include "unflex/gcode/interpreter.hpp"
#include "unflex/machine/machine.hpp"
#include "unflex/planner/planner.hpp"

namespace unflex::machine {

[[nodiscard]] gcode::InterpreterOptions interpreter_options(const Settings& settings);
[[nodiscard]] planner::Limits planner_limits(const Settings& settings);
[[nodiscard]] planner::FirmwareConfig firmware_config(const Settings& settings);
// An advance of 0 stands for the advance that the file or the printer has set.
[[nodiscard]] dynamics::HotendPressure hotend_pressure(const Settings& settings);

// The grid of coordinates where lines do not end on whole steps, mm.
inline constexpr double kGrid_mm = 1e-4;
// The grid on which lines end, mm: that one, or steps.
[[nodiscard]] double grid_mm(const Settings& settings);

// The settings of a machine that has this tool and no other. A tool that the settings do not tell
// of is as the printer itself.
[[nodiscard]] Settings with_tool(Settings settings, int number);

// What mass, height and place make of an axis' frequencies, as factors.
struct FrequencyShare {
  double by_print = 1.0;  // mass and height
  double by_place = 1.0;
};

// The settings of a machine on whose bed a mass lies, and whose nozzle is near a place. Frequencies
// are those there. They still depend on the place, and no longer on mass and height.
[[nodiscard]] Settings with_frequencies(Settings settings, const Axes<FrequencyShare>& shares);

// How the axis' frequencies depend on the place, as shares of the axis' own.
[[nodiscard]] dynamics::FrequencyField frequency_field(const AxisDynamics& dynamics);

[[nodiscard]] dynamics::FlexibleAxis flexible_axis(const std::vector<ModeSettings>& settings);
[[nodiscard]] dynamics::FlexibleAxis flexible_axis(const AxisDynamics& dynamics);
// The axis with a second mode behind it; without one if its frequency is 0.
[[nodiscard]] dynamics::FlexibleAxis behind(const dynamics::FlexibleAxis& axis, double freq_hz,
                                            double damping_ratio);
// The axes as they swing. Windows are solved for the axes of `dynamics` alone, without what rings
// behind them (SecondSettings).
[[nodiscard]] Axes<dynamics::FlexibleAxis> nozzle_axes(const Settings& settings);

}  // namespace unflex::machine
