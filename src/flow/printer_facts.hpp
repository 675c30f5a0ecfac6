// What a report says of the printer.
#pragma once

#include <optional>

#include "unflex/machine/machine.hpp"
#include "unflex/record/recorder.hpp"
#include "unflex/report/report.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::flow {

[[nodiscard]] report::PrinterFacts printer_facts(const machine::Settings& settings);

// The shaper that the printer's configuration has, whatever the print sets; nullopt if it has none
// or none is known.
[[nodiscard]] std::optional<record::PrinterShaper> printer_shaper(const verify::Rules& rules);

}  // namespace unflex::flow
