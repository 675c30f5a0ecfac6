// unflex kinematics: what a print asks of the joints, or the machine's map from measured places.
#pragma once

#include <string>

#include "console.hpp"
#include "unflex/app/run_config.hpp"
#include "unflex/flow/joint_use.hpp"
#include "unflex/kinematics/fit.hpp"
#include "unflex/kinematics/points.hpp"

namespace unflex::app {

[[nodiscard]] std::string joints_text(const flow::PrintInJoints& print, const std::string& input,
                                      const machine::Settings& settings);

// The lines for a printer file.
[[nodiscard]] std::string rows_text(const kinematics::Fit& fit);
// How well they suit the places, and which rail is off.
[[nodiscard]] std::string residuals_text(const kinematics::Fit& fit,
                                         const kinematics::Points& points);

// Errors of kind usage: neither a print nor places, or both, or a printer with the places.
[[nodiscard]] Status check_kinematics(const RunConfig& config);

[[nodiscard]] Result<ExitCode> run_kinematics(const RunConfig& config, Console& console);

}  // namespace unflex::app
