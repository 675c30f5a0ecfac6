// The characters that separate the names of folders.
#pragma once

#include <string_view>

namespace unflex::platform {

extern const std::string_view kSeparators;

// The length of the part of a name that leads to the top: 1 for "/a", 3 for "C:\a"; 0 for a name
// that counts from the current folder.
[[nodiscard]] std::size_t root_length(std::string_view name);

}  // namespace unflex::platform
