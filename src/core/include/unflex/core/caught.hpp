// Exceptions of the standard library as errors.
#pragma once

#include <exception>

#include "unflex/core/error.hpp"

namespace unflex {

// The exception as an error of kind internal. If memory or threads ran out, the error names a
// remedy.
[[nodiscard]] Error error_of(const std::exception& exception);

}  // namespace unflex
