// What the user may have meant by a name that does not exist.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace unflex {

// ", did you mean 'limits.max_accel_mm_s2'?" for the one of `names` that is near `typed`, or "" if
// none is. A dot ends a section: the same name in another section is near.
[[nodiscard]] std::string suggestion(std::string_view typed,
                                     const std::vector<std::string_view>& names);

}  // namespace unflex
