#pragma once

#include <string>

#include "unflex/platform/descriptors.hpp"

namespace unflex::platform {

// Opens a file so that others may read, write, rename and remove it meanwhile, as elsewhere.
[[nodiscard]] FileDescriptor open_shared(const std::string& name, unsigned long access,
                                         unsigned long creation, unsigned long flags = 0);

}  // namespace unflex::platform
