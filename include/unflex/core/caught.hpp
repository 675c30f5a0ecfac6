// Exceptions of the standard library as errors.
#pragma once

#include <exception>

#include "unflex/core/error.hpp"

namespace unflex {

// Of kind internal. Memory or threads that ran out come with a remedy.
[[nodiscard]] Error error_of(const std::exception& exception);

}  // namespace unflex
