// Calls about files that POSIX and WASI have in common.
#pragma once

#include <cerrno>
#include <string>

#include "unflex/platform/descriptors.hpp"

namespace unflex::platform {

// 0 or the errno of a call that returns 0 where it succeeds.
[[nodiscard]] inline int outcome(int result) { return result == 0 ? 0 : errno; }

// A new file that reads and writes. Not valid if it cannot be made, and if there is one of that
// name; then errno is EEXIST.
[[nodiscard]] FileDescriptor make_new_file(const std::string& name);

}  // namespace unflex::platform
