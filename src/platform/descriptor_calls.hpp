// What each system does with a descriptor. As in unflex/core/byte_stream.hpp; reads and writes
// return how many bytes, or a negative number and errno.
#pragma once

#include <chrono>
#include <cstddef>
#include <string_view>

namespace unflex::platform {

[[nodiscard]] bool wait_to_read(int descriptor, std::chrono::milliseconds most);
[[nodiscard]] bool wait_to_write(int descriptor, std::chrono::milliseconds most);
[[nodiscard]] std::ptrdiff_t read_bytes(int descriptor, char* to, std::size_t room);
[[nodiscard]] std::ptrdiff_t write_bytes(int descriptor, std::string_view bytes);

}  // namespace unflex::platform
