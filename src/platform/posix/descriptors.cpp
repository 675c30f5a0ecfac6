#include "unflex/platform/descriptors.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>

#include "../close_descriptor.hpp"

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

FileDescriptor open_to_read(const std::string& name) {
  return FileDescriptor(::open(name.c_str(), O_RDONLY | O_CLOEXEC));
}

FileDescriptor open_to_write(const std::string& name) {
  return FileDescriptor(::open(name.c_str(), O_WRONLY | O_CLOEXEC));
}

FileDescriptor open_to_append(const std::string& name) {
  constexpr int kMode = 0666;
  return FileDescriptor(::open(name.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC, kMode));
}

void close_descriptor(int descriptor) { ::close(descriptor); }

std::ptrdiff_t read_bytes_at(int descriptor, char* to, std::size_t room, std::uint64_t at) {
  return ::pread(descriptor, to, room, static_cast<off_t>(at));
}

}  // namespace unflex::platform
