// Axis windows and their solutions as bytes, between processes of one machine and one program.
#pragma once

#include <string>
#include <string_view>

#include "unflex/compensate/axis_window.hpp"
#include "unflex/core/error.hpp"

namespace unflex::flow {

[[nodiscard]] std::string pack(const compensate::AxisWindow& window);
[[nodiscard]] compensate::AxisWindow unpack_window(std::string_view bytes);

[[nodiscard]] std::string pack(const Result<compensate::AxisSolution>& solution);
[[nodiscard]] Result<compensate::AxisSolution> unpack_solution(std::string_view bytes);

}  // namespace unflex::flow
