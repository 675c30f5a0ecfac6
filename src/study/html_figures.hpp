// The figures of a case by one method.
#pragma once

#include <string>

#include "unflex/study/study.hpp"

namespace unflex::study {

// Path in the plane with a zoom on its corner, displacement, velocity and contour error over time,
// base and nozzle, with and without compensation; a legend above them. HTML, inline SVG.
[[nodiscard]] std::string figures(const CaseResult& result, const MethodResult& method);

// Base and nozzle over time after a step of 1 mm, plain and shaped, a plot for each damping ratio
// of the table of step.hpp; a legend above them. HTML, inline SVG.
[[nodiscard]] std::string step_figures();

}  // namespace unflex::study
