// Variants of firmware in the field: which one a printer runs, told by what the printer and its
// files say, and what follows for compensated prints. One row per variant; docs/compatibility.md
// has the sources.
#pragma once

#include <optional>
#include <string_view>

#include "assign.hpp"
#include "unflex/machine/print_text.hpp"

namespace unflex::machine {

// Takes printer.variant and printer.version from a printer file's text, comments too, if it holds
// what M115 or klippy.log say.
void recognise_firmware(std::string_view text, const std::string& file, Reading& reading);

// Takes printer.variant from a print, by the printer it was sliced for. Not if the print is known
// to be run by a firmware that no such printer has.
void recognise_print(const PrintText& print, std::string_view printer_model,
                     const SourcePlace& model_place, std::optional<Firmware> runs,
                     Reading& reading);

// Takes printer.ft_motion and printer.linear_advance_s from the lines before the first move of a
// Marlin print. These override what the printer has stored.
void read_start_code(const PrintText& print, Draft& draft);

// Notes and the refusal that follow from all that is known. The last step of reading settings.
void judge_variant(Draft& draft);

// Whether a version as firmware writes it, "3.6.0-beta.1", is known and at least major.minor.
[[nodiscard]] bool is_at_least(std::string_view version, int major, int minor);

}  // namespace unflex::machine
