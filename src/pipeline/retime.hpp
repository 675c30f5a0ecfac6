// What a file says of its duration, made true again.
#pragma once

#include <string>

#include "unflex/core/error.hpp"

namespace unflex::pipeline {

// Multiplies the durations in M73 and in the slicer's comments by `factor`, in place. Fails if the
// file cannot be read or written; `name` is what the error calls it.
[[nodiscard]] Status retime(const std::string& path, const std::string& name, double factor);

}  // namespace unflex::pipeline
