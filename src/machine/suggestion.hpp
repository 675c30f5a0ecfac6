// What the user may have meant by a name that does not exist.
#pragma once

#include <string>
#include <string_view>

namespace unflex::machine {

// ", did you mean 'limits.max_accel_mm_s2'?" for a key or section near `name`, else "".
[[nodiscard]] std::string suggest_key(std::string_view name);
[[nodiscard]] std::string suggest_section(std::string_view name);

}  // namespace unflex::machine
