// Figures and lists as every summary of the program writes them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "unflex/report/report.hpp"

namespace unflex::report {

// Three figures, so that 1234 µm and 0.05 µm fit the same column; without the unit.
[[nodiscard]] std::string micrometres_text(double mm);

// The flow difference: "at most 3.1 % more than as sliced over 10 ms, near line 813; 1.2 for 99 %
// of the time".
[[nodiscard]] std::string flow_difference_text(const verify::FlowDifference& difference);

// "21 times less than now". times: the error before over the error now; 0: none is left.
[[nodiscard]] std::string times_text(double times);

// "16.2 → 0.54": shares as percent, without the unit.
[[nodiscard]] std::string percent_change_text(double from, double to);
// The RMS error of the line's width with another hotend, in the form of percent_change_text().
[[nodiscard]] std::string width_change_text(const verify::LineStats& before,
                                            const verify::LineStats& after,
                                            verify::OtherHotend hotend);

// "0.90 to 3.10": the least and the greatest RMS of the plants, µm, without the unit.
[[nodiscard]] std::string range_text(const std::vector<PlantDeviation>& plants,
                                     Spread PlantDeviation::*which);

// 0.9876 → "98.7 %". Only a share of 1 is "100.0 %".
[[nodiscard]] std::string share_text(double share);

// A setting's value as people read it: its numbers are readable(), texts stay as they are.
[[nodiscard]] std::string setting_text(std::string_view value);

// The first few unknown commands, as lines of a summary.
[[nodiscard]] std::string unknown_text(const std::vector<UnknownCommand>& commands);

// The rates of the motors as a line of a summary; empty where no steps per mm are known.
// has_output: whether there are emitted lines.
[[nodiscard]] std::string step_rates_text(const StepRates& rates, bool has_output);
// The text of step_rates_text() without the line's name and its ending.
[[nodiscard]] std::string step_rates_list(const StepRates& rates, bool has_output);

// How far the hotend is off its target, as a line of a summary; empty without a model of it.
[[nodiscard]] std::string temperature_text(const std::optional<Temperature>& temperature);
// The parts of temperature_text(), one by one.
[[nodiscard]] std::vector<std::string> temperature_list(const Temperature& temperature);

// 3725.4 → "1h 02m 05s"; below a minute with tenths, "5.3s".
[[nodiscard]] std::string duration_text(double seconds);

}  // namespace unflex::report
