// A print as what the motors of a machine shall do, for a firmware that knows X, Y and Z alone.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/core/text_store.hpp"
#include "unflex/machine/machine.hpp"

namespace unflex::flow {

struct TranslatedPrint {
  std::size_t moves = 0;  // lines that move the tool
  std::size_t lines = 0;  // what was written for them
  std::vector<std::string> warnings;
};

// Reads the print and writes it block by block, with the joints of the settings' machine, mm, in
// the places of X, Y and Z. name: what messages call the print. Errors are of kind input, with the
// line: a place that the tool cannot reach, a line that cannot be translated safely, a print that
// unflex has compensated or translated before. So are those of reading and of `write`, and of kind
// internal if it was cancelled.
[[nodiscard]] Result<TranslatedPrint> translate(
    const TextStore& print, const std::string& name, const machine::Settings& settings,
    Progress& progress, const std::function<Status(std::string_view)>& write);

}  // namespace unflex::flow
