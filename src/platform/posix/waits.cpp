#include <poll.h>

#include <cerrno>

#include "unflex/platform/descriptors.hpp"

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

}  // namespace unflex::platform
