#include "../descriptor_calls.hpp"

#include <poll.h>
#include <unistd.h>

#include <cerrno>

namespace unflex::platform {
namespace {

bool wait_for(int descriptor, short events, std::chrono::milliseconds most) {
  pollfd what{descriptor, events, 0};
  const int count = ::poll(&what, 1, static_cast<int>(most.count()));
  return count > 0 || (count < 0 && errno != EINTR);
}

}  // namespace

bool wait_to_read(int descriptor, std::chrono::milliseconds most) {
  return wait_for(descriptor, POLLIN, most);
}

bool wait_to_write(int descriptor, std::chrono::milliseconds most) {
  return wait_for(descriptor, POLLOUT, most);
}

std::ptrdiff_t read_bytes(int descriptor, char* to, std::size_t room) {
  return ::read(descriptor, to, room);
}

std::ptrdiff_t write_bytes(int descriptor, std::string_view bytes) {
  return ::write(descriptor, bytes.data(), bytes.size());
}

}  // namespace unflex::platform
