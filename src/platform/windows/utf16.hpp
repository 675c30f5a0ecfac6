// Names, which are UTF-8 here and UTF-16 in the system, and the system's errors as values of errno.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace unflex::platform {

// Leads to the file however long the name is.
[[nodiscard]] std::filesystem::path path_of(std::string_view name);
[[nodiscard]] std::string name_of(const std::filesystem::path& path);
[[nodiscard]] std::string utf8(std::wstring_view text);

// The reason why the last call of the system failed. Sets errno too.
int last_error();

}  // namespace unflex::platform
