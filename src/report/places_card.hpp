// The card of the page that tells how far the nozzle strays in each part of the bed.
#pragma once

#include <string>

#include "unflex/verify/measured.hpp"

namespace unflex::report {

// <section class="card"> with a picture of the squares as sliced and as written, and a table of the
// bands of height. Empty if the frequencies of the machine stay.
[[nodiscard]] std::string places_card(const verify::Measured& measured);

}  // namespace unflex::report
