// The printer of a machine's settings, as a text machine takes it.
#pragma once

#include "same_print.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::testing {

[[nodiscard]] Printer printer_with(const machine::Settings& settings);

}  // namespace unflex::testing
