// A print's text, fitted to the filament that there is.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/text_store.hpp"
#include "unflex/filament/fitter.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::filament {

struct FittedPrint {
  filament::Totals totals;
  std::vector<std::string> warnings;
};

// Reads the print and writes it block by block, as the settings' filament asks for. name: what
// messages call the print. is_marked: the text ends with a comment by which it is known again.
// Errors are those of filament::Fitter::fit(), of reading and of `write`.
[[nodiscard]] Result<FittedPrint> fit_filament(
    const TextStore& print, const std::string& name, const machine::Settings& settings,
    const filament::Profile& profile, bool is_marked,
    const std::function<Status(std::string_view)>& write);

}  // namespace unflex::filament
