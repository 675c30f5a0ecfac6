// The meaning of the operating system's errors, for messages.
#pragma once

#include <string>

namespace unflex {

// The text of an error, such as "No such file or directory".
[[nodiscard]] std::string errno_text(int error);

// The text of an error in writing, with what can be done about it.
[[nodiscard]] std::string write_error_text(int error);

}  // namespace unflex
