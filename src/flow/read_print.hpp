// Reads a print from its beginning to its end.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "unflex/core/error.hpp"
#include "unflex/core/progress.hpp"
#include "unflex/flow/flow.hpp"
#include "unflex/run/piece_reader.hpp"

namespace unflex::flow {

// Calls take(piece) for each piece of job.input. Gives the warnings about the text, as they are
// shown. Errors are those of PieceReader::next(), and of kind internal if it was cancelled.
[[nodiscard]] Result<std::vector<std::string>> read_print(
    const Job& job, Progress& progress, const std::function<void(const run::Piece&)>& take);

}  // namespace unflex::flow
