// The card of the page that tells of the hotend's temperature.
#pragma once

#include <string>

#include "unflex/report/temperature.hpp"

namespace unflex::report {

// <section class="card">, with a figure of target and temperature over time.
[[nodiscard]] std::string temperature_card(const Temperature& temperature);

}  // namespace unflex::report
