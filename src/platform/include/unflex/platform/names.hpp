// The parts of a file's name, as text; no file is looked at. Folders are parted by '/', and on
// Windows by '\' as well.
#pragma once

#include <string>
#include <string_view>

namespace unflex::platform {

// "a/b" → "a", "/a" → "/", "a" → "".
[[nodiscard]] std::string folder_of(std::string_view name);
// "a/b.c" → "b.c".
[[nodiscard]] std::string last_part(std::string_view name);
// "a/b.c" → ".c"; a name that merely begins with a dot has no ending.
[[nodiscard]] std::string ending_of(std::string_view name);
// The name with another ending in the place of its own.
[[nodiscard]] std::string with_ending(std::string_view name, std::string_view ending);
// `name` as seen from `folder`, which may be empty.
[[nodiscard]] std::string joined(std::string_view folder, std::string_view name);

}  // namespace unflex::platform
