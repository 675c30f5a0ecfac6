// The figures of a case by one method.
#pragma once

#include <string>

#include "unflex/study/study.hpp"

namespace unflex::study {

// Path in the plane with a zoom on its corner, displacement, velocity and contour error over time,
// base and nozzle, with and without compensation; a legend above them. HTML, inline SVG.
[[nodiscard]] std::string figures(const CaseResult& result, const MethodResult& method);

}  // namespace unflex::study
