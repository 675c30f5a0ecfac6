// How the system parts the names of folders.
#pragma once

#include <string_view>

namespace unflex::platform {

extern const std::string_view kSeparators;

// The part of a name that leads to the top: 1 for "/a", 3 for "C:\a"; 0 if the name counts from
// where one is.
[[nodiscard]] std::size_t root_length(std::string_view name);

}  // namespace unflex::platform
