// A new file that reads and writes.
#pragma once

#include <string>

#include "unflex/platform/descriptors.hpp"

namespace unflex::platform {

// Not valid if it cannot be made, and if there is one of that name; then errno is EEXIST.
[[nodiscard]] FileDescriptor make_new_file(const std::string& name);

}  // namespace unflex::platform
