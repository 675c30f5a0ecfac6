// A read or write waits itself, since there is nothing else to do meanwhile.
#include "../descriptor_calls.hpp"

#include <unistd.h>

namespace unflex::platform {

bool wait_to_read(int /*descriptor*/, std::chrono::milliseconds /*most*/) { return true; }

bool wait_to_write(int /*descriptor*/, std::chrono::milliseconds /*most*/) { return true; }

std::ptrdiff_t read_bytes(int descriptor, char* to, std::size_t room) {
  return ::read(descriptor, to, room);
}

std::ptrdiff_t write_bytes(int descriptor, std::string_view bytes) {
  return ::write(descriptor, bytes.data(), bytes.size());
}

}  // namespace unflex::platform
