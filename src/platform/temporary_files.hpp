// Files that are soon renamed or removed, the part that is the same on all systems.
#pragma once

#include <string>
#include <tl/expected.hpp>

#include "unflex/platform/replacing.hpp"

namespace unflex::platform {

// Makes a file with a name that nobody has. make: makes the file with this name, to read and write;
// if there is one, the descriptor is not valid and errno is EEXIST.
[[nodiscard]] tl::expected<LockedFile, int> make_temporary_file(
    const std::string& folder, FileDescriptor (*make)(const std::string& name));

}  // namespace unflex::platform
