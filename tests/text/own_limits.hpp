// The printer that the settings describe, in the form that a text machine takes.
#pragma once

#include "same_print.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::testing {

[[nodiscard]] Printer printer_with(const machine::Settings& settings);

}  // namespace unflex::testing
