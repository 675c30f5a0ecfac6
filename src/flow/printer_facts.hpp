// Facts about the printer for the report.
#pragma once

#include <optional>

#include "unflex/machine/machine.hpp"
#include "unflex/record/recorder.hpp"
#include "unflex/report/report.hpp"
#include "unflex/verify/verify.hpp"

namespace unflex::flow {

[[nodiscard]] report::PrinterFacts printer_facts(const machine::Settings& settings);

// The shaper in the printer's configuration, whatever the print sets. nullopt if there is none, or
// none is known.
[[nodiscard]] std::optional<record::PrinterShaper> printer_shaper(const verify::Rules& rules);

}  // namespace unflex::flow
